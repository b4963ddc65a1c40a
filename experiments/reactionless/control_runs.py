"""The controllers' comparison run: machines trained, loops closed, numbers taken."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from experiments.reactionless.control_cases import ROBOT, START, case, drawn_loads, published_case
from jffsr.compiling import jit
from jffsr.dynamics.kinematics import kinematics
from jffsr.dynamics.momentum import base_twist
from jffsr.reactionless.control.computed_torque import ComputedTorque
from jffsr.reactionless.control.errors import Gains
from jffsr.reactionless.control.extreme_learning import HIDDEN, INPUTS, ExtremeLearning, random_machine
from jffsr.reactionless.control.learnt_load import LearntLoad
from jffsr.reactionless.control.passivity import PassivityBased
from jffsr.reactionless.control.proportional_derivative import ProportionalDerivative
from jffsr.reactionless.control.training import MachineTraining, train_machine
from jffsr.reactionless.interface import Desired
from jffsr.reactionless.plant import closed_loop
from jffsr.reactionless.plant_mujoco import closed_loop_mujoco
from jffsr.reactionless.plant_run import LoopRun
from jffsr.reactionless.plant_settings import JointDisturbance, LoopSettings, Strike
from jffsr.reactionless.plant_strike import Pendulum
from jffsr.robots.state import State
from jffsr.types import Array

PERIOD, DURATION = 0.01, 20.0
SAMPLES = int(DURATION / PERIOD)
STRUCK = 10.0
TRAINING_SAMPLES, TRAINING_LOADS, TRAINING_SEED = 400, 2, 1000
PD, ELM, PSO, SSADE, ONES = "PD", "ELM", "PSO-ELM", "SSADE-ELM", "integrator"
COMPUTED, PASSIVITY, LEARNT = "computed torque", "passivity-based", "learnt load"
PSO_LONG, SSADE_LONG = "PSO-ELM, 30,000", "SSADE-ELM, 30,000"
CONTROLLERS = (PD, ELM, PSO, SSADE, PSO_LONG, SSADE_LONG, ONES, COMPUTED, PASSIVITY, LEARNT)
LONG = 30_000
SIMULATION, STROKE, HIT, QUIET = "simulation", "stroke", "hit", "undisturbed"
_NO_STRIKE = Strike(np.zeros(6), STRUCK)
SCENES = {
    SIMULATION: (JointDisturbance.published(), _NO_STRIKE),
    STROKE: (JointDisturbance.published(), Pendulum().strike(STRUCK)),
    HIT: (JointDisturbance.published(), Pendulum().strike(STRUCK, with_force=True)),
    QUIET: (JointDisturbance(), _NO_STRIKE),
}
POSTURE = np.zeros(3)


def machines(seeds: int, evaluations: int, kept: Path | None) -> dict[str, np.ndarray]:
    """Free numbers (seeds, 360) of each kind of machine; of the paper's full budget, one seed.

    What the searches found is read from `kept` where it is there.
    """
    found = {ELM: np.array([random_machine(jax.random.key(seed)) for seed in range(seeds)])}
    # Hidden nodes that are all one: the machine is then nothing but an integrator.
    ones = np.concatenate([np.zeros(HIDDEN * INPUTS), np.full(HIDDEN, 40.0)])
    found[ONES] = np.broadcast_to(ones, (seeds, ones.size))
    if kept is not None and kept.exists():
        with np.load(kept) as read:
            return {**found, **{name: read[name][:seeds] for name in read.files}}
    problem = training_problem()
    jobs = ((PSO, "pso", evaluations, seeds), (SSADE, "ssade", evaluations, seeds))
    for name, search, budget, count in (*jobs, (PSO_LONG, "pso", LONG, 1), (SSADE_LONG, "ssade", LONG, 1)):
        best = []
        for seed in range(count):
            begun = time.perf_counter()
            outcome = train_machine(problem, search, budget, jax.random.key(seed), chunk=20)
            best.append(outcome.best_position)
            seconds = time.perf_counter() - begun
            print(f"{name} {seed}: {outcome.best_value:.5f} rad, {seconds:.1f} s", flush=True)
        found[name] = np.array(best)
    if kept is not None:
        np.savez(kept, **{name: found[name] for name in (PSO, SSADE, PSO_LONG, SSADE_LONG)})
    return found


def training_values(weights: dict[str, np.ndarray]) -> dict[str, float]:
    """What each kind of machine comes to on the training runs, rad: the median over the seeds."""
    value = jit(jax.vmap(training_problem().value))
    return {name: float(np.median(value(jnp.asarray(free)))) for name, free in weights.items()}


def integral_gains(weights: dict[str, np.ndarray]) -> dict[str, float]:
    """The sum of h^2 of each kind of machine, 1/s: mean over joints and the reference, median over the seeds."""
    record = published_case(SAMPLES, PERIOD).record
    motion = Desired(record.joint_position, record.joint_velocity, record.joint_acceleration)
    motion = jax.tree.map(lambda leaf: leaf[::50], motion)

    def gain(free: Array) -> Array:
        machine = controller(ELM, free)
        nodes = jax.vmap(lambda desired: machine.hidden(desired, jnp.zeros(3), jnp.zeros(3)))(motion)
        return jnp.mean(jnp.sum(nodes**2, axis=-1))

    each = jit(jax.vmap(gain))
    return {name: float(np.median(each(jnp.asarray(free)))) for name, free in weights.items()}


def training_problem() -> MachineTraining:
    """Loads drawn about the published one, which is not among them, and disturbances that no test has."""
    loads = jnp.asarray(drawn_loads(TRAINING_SEED, TRAINING_LOADS))
    cases = jit(jax.vmap(lambda load: case(load, TRAINING_SAMPLES, PERIOD)))(loads)
    settings = LoopSettings(TRAINING_SAMPLES, PERIOD, disturbance=JointDisturbance.published())
    keys = jax.random.split(jax.random.key(TRAINING_SEED), TRAINING_LOADS)
    blank = ExtremeLearning.of(ROBOT, POSTURE, np.zeros(HIDDEN * (INPUTS + 1)))
    return MachineTraining(cases.robot, cases.state, cases.record, keys, blank, settings)


def controller(name: str, free: np.ndarray | None = None):
    """One of CONTROLLERS, with the robot without load as all that it knows."""
    if name == PD:
        return ProportionalDerivative.of(ROBOT, POSTURE)
    if name == COMPUTED:
        return ComputedTorque.of(ROBOT)
    if name == LEARNT:
        return LearntLoad.of(ROBOT)
    if name == PASSIVITY:
        return PassivityBased.of(ROBOT)
    return ExtremeLearning.of(ROBOT, POSTURE, free)


def settings(scene: str) -> LoopSettings:
    """The loop of a scene, 100 Hz, no noise."""
    disturbance, strike = SCENES[scene]
    return LoopSettings(SAMPLES, PERIOD, disturbance=disturbance, strike=strike)


@jit
def _loops(published, controllers, settings, keys) -> LoopRun:
    def one(controller, key):
        return closed_loop(published.robot, published.state, published.record, controller, settings, key)

    return jax.vmap(one)(controllers, keys)


def loops(name: str, weights: dict[str, np.ndarray], scene: str, seeds: int) -> LoopRun:
    """A controller's runs of a scene, leaves (seeds, ...); the seed draws the disturbance and, of machines, weights."""
    seeds = min(seeds, len(weights[name])) if name in weights else seeds
    each = [controller(name, weights[name][s] if name in weights else None) for s in range(seeds)]
    stacked = jax.tree.map(lambda *leaves: jnp.stack([jnp.asarray(x, dtype=float) for x in leaves]), *each)
    keys = jax.vmap(jax.random.key)(jnp.arange(seeds))
    loop = jax.tree.map(lambda x: jnp.asarray(x, dtype=float), settings(scene))
    return _loops(published_case(SAMPLES, PERIOD), stacked, loop, keys)


def numbers(run: LoopRun) -> Iterator[dict]:
    """One mapping a seed: tracking errors in rad, the base's rate in rad/s, the result code."""
    errors, spin = np.asarray(run.error), np.asarray(run.states.base_twist)[..., 5]
    total = np.asarray(run.momentum)
    half = SAMPLES // 2
    for seed, error in enumerate(errors):
        found = {
            "mean": float(error.mean()),
            "mean_later": float(error[half:].mean()),
            "rms": float(np.sqrt((error**2).mean())),
            "rms_later": float(np.sqrt((error[half:] ** 2).mean())),
            "peak": float(np.abs(error).max()),
            "peak_later": float(np.abs(error[half:]).max()),
            "base_rate": float(np.sqrt((spin[seed, half:] ** 2).mean())),
            "momentum": float(np.abs(total[seed, half - 1] - total[seed, 0]).max()),
            "torque": float(np.abs(run.torque[seed]).max()),
        }
        rounded = {key: float(f"{value:.5g}") for key, value in found.items()}
        yield {"seed": seed, **rounded, "code": int(run.code[seed])}


def curves(run: LoopRun, seed: int = 0, every: int = 10) -> dict:
    """What the figures show of one run, thinned."""
    at = slice(None, None, every)
    return {
        "time": np.asarray(run.time)[seed, at].round(2).tolist(),
        "error": np.asarray(run.error)[seed, at].round(6).T.tolist(),
        "base_rate": np.asarray(run.states.base_twist)[seed, at, 5].round(7).tolist(),
        "momentum": np.asarray(run.momentum)[seed, at, 5].round(7).tolist(),
    }


def on_mujoco(weights: dict[str, np.ndarray], run: LoopRun, seed: int = 0) -> dict:
    """The simulation's run of SSADE-ELM once more with MuJoCo as the plant, and how far the two are apart."""
    published = published_case(SAMPLES, PERIOD)
    machine = controller(SSADE, weights[SSADE][seed])
    finer = replace(settings(SIMULATION), substeps=4)
    arguments = (published.robot, published.state, published.record, machine, finer)
    other = closed_loop_mujoco(*arguments, jax.random.key(seed))
    here = np.asarray(run.error)[seed]
    there = np.asarray(other.error)
    return {
        "rms": float(np.sqrt((here**2).mean())),
        "rms_mujoco": float(np.sqrt((there**2).mean())),
        "apart": float(np.abs(here - there).max()),
        "momentum": float(np.abs(np.asarray(other.momentum) - np.asarray(other.momentum)[0]).max()),
        "code": int(other.code),
    }


def by_period(periods: tuple[float, ...], duration: float = 5.0) -> Iterator[dict]:
    """The base's largest rate at each control period, rad/s, started on the reference, without disturbance.

    Feedforward of the true compound's model with slow gains, so that sampling alone matters; and the PD beside it.
    """
    gains = Gains(np.full(3, 5.0), np.ones(3))
    for period in periods:
        count = round(duration / period)
        published = published_case(count, period)
        rates = published.record.joint_velocity[0]
        start = START
        kin = kinematics(published.robot, start)
        twist = base_twist(published.robot, kin, rates, published.momentum)
        start = State(start.base_position, start.base_quaternion, start.joint_position, twist, rates)
        substeps = max(1, round(period / 0.005))
        row = {"period": period, "started": float(jnp.linalg.norm(twist[3:]))}
        known = {"feedforward": ComputedTorque(published.robot, gains)}
        known["pd"] = replace(ProportionalDerivative.of(ROBOT, POSTURE), gains=gains)
        for name, law in known.items():
            loop = LoopSettings(count, period, substeps=substeps)
            run = jit(closed_loop)(published.robot, start, published.record, law, loop, jax.random.key(0))
            row[name] = float(np.abs(np.asarray(run.states.base_twist)[:, 3:]).max())
        yield row
