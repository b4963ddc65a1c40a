"""Random captures and the rule by which one counts as feasible. Nothing here knows of the planner.

A sample is a box of random sides, turned at random, that turns at up to 5 degrees a second before the robot, with a
handle standing out of one face. Its moments of inertia are drawn from what rigid bodies can have, whatever the box. A
sample is feasible where, at one of a few times when the handle looks at the tool, there is a posture, reached by the
straight joint path with the base free, inside the joint limits, clear of everything, and from which the tool can have
the handle's velocity inside the joint rates. What stands between (rates and accelerations over time, the cone,
clearance on the way) is left to the planner. Rejections are counted by the first of these that fails.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import yaml

import jffsr
from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.inverse_kinematics import random_starts
from jffsr.capture.inverse_kinematics_floating import floating_inverse_kinematics
from jffsr.clearance.model import ClearanceModel
from jffsr.dynamics.kinematics import kinematics
from jffsr.dynamics.momentum import generalized_jacobian
from jffsr.parallel.mapping import map_batch
from jffsr.robots.geometry import BOX, COLLISION, VISUAL, Geometry, Shape
from jffsr.robots.stacking import stacked
from jffsr.spatial.rotation import quaternion_to_matrix
from jffsr.target.body import Target
from jffsr.target.target_state import TargetState
from jffsr.target.tumbling import target_motion

SEEDS = Path(__file__).with_name("seeds.yaml")

ROBOT = "servicer_7dof"
START = np.deg2rad([0.0, -60.0, 0.0, 45.0, 0.0, -15.0, 0.0])
REACH = 3.2
"""m, of the tool from the system's centre of mass; the arm's length bounds it by 3.52 m."""

LARGEST_RATE = np.deg2rad(5.0)
CENTRE_LOW, CENTRE_HIGH = np.array([1.5, -0.9, -2.6]), np.array([2.7, 0.9, -0.6])
HALF_SIDES = (0.2, 0.35)
STANDS_OUT = 0.15
"""m, of the handle's end, where the tool grasps, from the face."""
OFF_CENTRE = 0.1
LEAST_RATIO = 0.35
"""Least moment of inertia over the largest."""

WINDOW = (15.0, 60.0)
"""s, of possible times of the grasp."""
TIME_STEP = 1.0
CANDIDATES, APART = 4, 4.0
"""How many times are looked at, and how far apart, s, they are."""
POSTURES = 6
MARGIN = 0.03
"""m, between all bodies at the grasp, and between base and target at all times."""
RATE_SHARE = 0.8
"""Of the joint rates' limits, for the velocity at the grasp."""
MOTION_STEPS = 48
POSE_TOLERANCE = 1e-3

REASONS = (
    "the target hits the base",
    "the handle never faces the tool within reach",
    "no posture reaches the handle",
    "every such posture collides",
    "its velocity is beyond the joint rates",
)


@dataclass(frozen=True)
class Sample:
    """One random capture: numbers only, so that a thousand of them are a small file.

    half (3,), m, of the box; inertia (3,), kg m^2; position (3,), m, quaternion (4,), angular velocity (3,), rad/s, in
    T; grasp position (3,), m, and quaternion (4,) in T.
    """

    half: np.ndarray
    inertia: np.ndarray
    position: np.ndarray
    quaternion: np.ndarray
    rate: np.ndarray
    grasp_position: np.ndarray
    grasp_quaternion: np.ndarray


def read_seed(name: str) -> int:
    """A seed of the seed file."""
    return int(yaml.safe_load(SEEDS.read_text())[name])


def draw(seed: int, number: int) -> Sample:
    """The sample of this number; samples do not depend on how many are drawn."""
    rng = np.random.default_rng([seed, number])
    half = rng.uniform(*HALF_SIDES, 3)
    ratios = _ratios(rng)
    mass = 300.0
    position = rng.uniform(CENTRE_LOW, CENTRE_HIGH)
    quaternion = _unit(rng.normal(size=4))
    rate = rng.uniform(0, LARGEST_RATE) * _unit(rng.normal(size=3))
    grasp_position = np.array([-half[0] - STANDS_OUT, *rng.uniform(-OFF_CENTRE, OFF_CENTRE, 2)])
    roll = rng.uniform(-np.pi, np.pi)
    grasp_quaternion = np.array([np.cos(roll / 2), np.sin(roll / 2), 0.0, 0.0])
    largest = mass / 3 * np.sort(half**2)[1:].sum()
    return Sample(half, largest * ratios, position, quaternion, rate, grasp_position, grasp_quaternion)


def _ratios(rng: np.random.Generator) -> np.ndarray:
    """Three moments over the largest, of those that rigid bodies can have."""
    while True:
        ratios = rng.uniform(LEAST_RATIO, 1.0, 3)
        ratios = ratios / ratios.max()
        if 2 * ratios.max() < 0.999 * ratios.sum() and ratios.min() >= LEAST_RATIO:
            return ratios


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


@lru_cache(maxsize=1)
def robot() -> jffsr.Robot:
    """The arm of every capture."""
    return jffsr.load_robot(ROBOT)


def initial_state() -> jffsr.State:
    """At rest at the identity pose, the arm as in the published scenario."""
    return jffsr.State(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), START)


def geometry(half: np.ndarray) -> Geometry:
    """The box, and a handle for the eye alone."""
    box = Shape("box", BOX, "target", np.zeros(3), np.eye(3), np.asarray(half), roles=(VISUAL, COLLISION))
    return Geometry((box,))


def model_of(sample: Sample) -> ClearanceModel:
    """Clearance between the robot's bodies and the sample's box."""
    return ClearanceModel.create(robot(), geometry(sample.half))


def motion_of(sample: Sample, duration: float = WINDOW[1] + 1.0):
    """The target's motion; its shape is left to the clearance model, so that all samples share their programs."""
    target = Target.create(
        sample.inertia,
        300.0,
        grasps={"handle": (sample.grasp_position, sample.grasp_quaternion)},
    )
    state = TargetState.create(sample.position, np.zeros(3), sample.quaternion, sample.rate)
    return jax.device_get(_moving(target, state, duration))


@jax.jit
def _moving(target: Target, state: TargetState, duration: float):
    return target_motion(target, state, duration, MOTION_STEPS)


@dataclass(frozen=True)
class Verdict:
    """What the rule says of samples: reason (K,), 0 for feasible, else one more than the place in REASONS; time (K,),
    s, a time at which a feasible one can be grasped."""

    reason: np.ndarray
    time: np.ndarray

    @property
    def feasible(self) -> np.ndarray:
        """Boolean (K,)."""
        return self.reason == 0

    def rejections(self) -> dict[str, int]:
        """How many were rejected for each reason."""
        counts = Counter(self.reason.tolist())
        return {text: counts[k + 1] for k, text in enumerate(REASONS)}


def judge(samples: list[Sample]) -> Verdict:
    """The rule, applied to samples."""
    batch = stacked([(motion_of(sample), model_of(sample)) for sample in samples])
    reason, time = jax.device_get(map_batch(_judged, batch, chunk=8))
    return Verdict(reason, time)


def _judged(item) -> tuple[jax.Array, jax.Array]:
    motion, model = item
    path = GraspPath.create(motion)
    times = jnp.arange(WINDOW[0], WINDOW[1] + TIME_STEP / 2, TIME_STEP)
    chosen, facing = _candidates(path, times)
    frames = jax.vmap(lambda t: path.frame(t, t))(chosen)
    state = initial_state()
    starts = random_starts(robot(), jax.random.key(0), POSTURES)
    found = floating_inverse_kinematics(
        robot(),
        *frames[:2],
        state,
        starts,
        num_steps=16,
        position_tolerance=POSE_TOLERANCE,
        attitude_tolerance=POSE_TOLERANCE,
    )
    reached = found.success & facing[:, None]
    clear = jax.vmap(jax.vmap(partial(_least_clearance, model, path), in_axes=(None, 0, 0, 0)))(
        chosen, found.joint_position, found.base_position, found.base_quaternion
    )
    clear = reached & (clear >= MARGIN)
    rates = jax.vmap(jax.vmap(_rate_share, in_axes=(0, 0, 0, None)))(
        found.joint_position, found.base_position, found.base_quaternion, frames[2]
    )
    kept = clear & (rates <= RATE_SHARE)
    always = jnp.arange(0.0, WINDOW[1] + TIME_STEP / 2, TIME_STEP)
    base = model.pair_names.index(("base", "target"))
    resting = START, state.base_position, state.base_quaternion
    gaps = jax.vmap(lambda t: _clearances(model, path, t, *resting)[base])(always)
    tests = jnp.stack(
        [jnp.min(gaps) >= MARGIN, jnp.any(facing), jnp.any(reached), jnp.any(clear), jnp.any(kept)]
    )
    reason = jnp.where(jnp.all(tests), 0, 1 + jnp.argmin(tests))
    return reason, chosen[jnp.argmax(jnp.any(kept, axis=1))]


def _candidates(path: GraspPath, times: jax.Array) -> tuple[jax.Array, jax.Array]:
    """CANDIDATES times (c,) of least criterion, APART from each other, and whether the handle can be had there (c,).

    The criterion is that of the grasp time with the capability map left out; it is infinite where the handle looks
    away from the tool's start or is beyond the arm's reach.
    """
    kin = kinematics(robot(), initial_state())
    tool, _ = jffsr.end_effector_pose(robot(), kin)
    centre = jffsr.system_com(robot(), kin)

    def at(time):
        position, quaternion, _ = path.frame(time, time)
        way = position - tool
        along = quaternion_to_matrix(quaternion)[:, 0] @ way
        possible = (along > 0) & (jnp.linalg.norm(position - centre) < REACH)
        return jnp.where(possible, 2 * jnp.linalg.norm(way) - along, jnp.inf)

    values = jax.vmap(at)(times)
    chosen, facing = [], []
    for _ in range(CANDIDATES):
        best = jnp.argmin(values)
        chosen.append(times[best])
        facing.append(jnp.isfinite(values[best]))
        values = jnp.where(jnp.abs(times - times[best]) < APART, jnp.inf, values)
    return jnp.stack(chosen), jnp.stack(facing)


def _clearances(model: ClearanceModel, path: GraspPath, time, q, place, turn):
    kin = kinematics(robot(), jffsr.State(place, turn, q))
    target = path.target_state(time, time)
    return model(kin.origin, kin.rotation, target.position, quaternion_to_matrix(target.quaternion))


def _least_clearance(model: ClearanceModel, path: GraspPath, time, q, place, turn):
    return jnp.min(_clearances(model, path, time, q, place, turn))


def _rate_share(q, place, turn, twist):
    """The least joint rates for the tool's twist, the largest share of a limit."""
    jacobian = generalized_jacobian(robot(), kinematics(robot(), jffsr.State(place, turn, q)))
    rate = jacobian.T @ jnp.linalg.solve(jacobian @ jacobian.T + 1e-6 * jnp.eye(6), twist)
    return jnp.max(jnp.abs(rate) / robot().limits.velocity)


def feasible_samples(seed: int, count: int, at_once: int = 256) -> tuple[list[Sample], Verdict]:
    """The first `count` feasible samples of a seed, and the verdict over all that were drawn for them."""
    accepted: list[Sample] = []
    reasons, times = [], []
    drawn = 0
    while len(accepted) < count:
        samples = [draw(seed, number) for number in range(drawn, drawn + at_once)]
        drawn += at_once
        verdict = judge(samples)
        for sample, reason, time in zip(samples, verdict.reason, verdict.time, strict=True):
            if len(accepted) < count:
                reasons.append(reason)
                times.append(time)
                if reason == 0:
                    accepted.append(sample)
    return accepted, Verdict(np.array(reasons), np.array(times))


def first_feasible(seed: int, count: int, at_once: int = 32) -> list[int]:
    """Numbers of the first `count` feasible samples of a seed."""
    found: list[int] = []
    at = 0
    while len(found) < count:
        numbers = range(at, at + at_once)
        verdict = judge([draw(seed, number) for number in numbers])
        found += [number for number, good in zip(numbers, verdict.feasible, strict=True) if good]
        at += at_once
    return found[:count]


if __name__ == "__main__":
    jax.config.update("jax_enable_x64", True)
    for which in ("first", "second"):
        accepted, verdict = feasible_samples(read_seed(which), 1000)
        print(f"{which}: {len(accepted)} of {len(verdict.reason)} accepted")
        for text, number in verdict.rejections().items():
            print(f"  {number:5d}  {text}")
