"""What is asked of random robots: agreement with MuJoCo, conservation, and the symmetries of mechanics.

Every function returns relative errors, one a robot, under the name of the law. The robots of a batch share their
topology, so that a batch costs one compilation of `evaluate` and one of `coast`.
"""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from random_robots import (
    MOST_JOINTS,
    random_quaternion,
    random_robot,
    random_state,
    random_topology,
    stacked,
)

import jffsr
from jffsr.crosscheck.mujoco_model import to_mjmodel
from jffsr.robots.robot import Robot, Topology
from jffsr.robots.state import State
from jffsr.rollouts.hot_path import hot_joint_terms
from jffsr.spatial.rotation import quaternion_multiply, quaternion_to_matrix

TOLERANCE = 1e-9
COAST_SECONDS = 10.0
# rad/s and m/s at the start: a light link is soon several times faster.
COASTING_SPEED = 0.2
Errors = dict[str, np.ndarray]


class Batch:
    """Robots of one topology, each in a state of its own, with joint torques that act on it."""

    def __init__(self, seed: int, topology: Topology, count: int):
        rng = np.random.default_rng(seed)
        n = len(topology.parents)
        self.rng, self.count = rng, count
        self.robots = [random_robot(rng, topology) for _ in range(count)]
        self.states = [random_state(rng, n, 1.0) for _ in range(count)]
        self.torques = rng.normal(size=(count, n)) * 5.0

    @property
    def arguments(self) -> tuple[Robot, State, np.ndarray]:
        """Robots, states and torques, each with a leading axis."""
        return stacked(self.robots), stacked(self.states), self.torques


@jax.jit
@partial(jax.vmap)
def evaluate(robot: Robot, state: State, torque):
    """Everything that the laws compare, of one robot in one state under joint torques."""
    kin = jffsr.kinematics(robot, state)
    velocities = state.base_twist, state.joint_velocity
    h_b, h_bm, h_m = jffsr.inertia_blocks(robot, kin)
    acceleration = jffsr.forward_dynamics(robot, kin, *velocities, torque)
    back, base = jffsr.inverse_dynamics(robot, kin, *velocities, acceleration[6:])
    terms = hot_joint_terms(robot, state.joint_position[None], state.joint_velocity[None])
    return {
        "rollout_inertia": jnp.array(terms.inverse_inertia)[:, 0],
        "rollout_rate": jnp.array(terms.base_rate((0.0, 0.0, 0.0)))[:, 0],
        "rollout_com_velocity": jnp.array(terms.com_velocity)[:, 0],
        "inertia": jnp.block([[h_b, h_bm], [h_bm.T, h_m]]),
        "bias": jffsr.bias_force(robot, kin, *velocities),
        "acceleration": acceleration,
        "torque": back,
        "base_acceleration": base,
        "momentum": jffsr.momentum(robot, kin, *velocities),
        "energy": jffsr.kinetic_energy(robot, kin, *velocities),
        "system_com": jffsr.system_com(robot, kin),
    }


@jax.jit
@partial(jax.vmap)
def inverse(robot: Robot, state: State, joint_acceleration):
    """Joint torque and base acceleration for joint accelerations from elsewhere."""
    kin = jffsr.kinematics(robot, state)
    return jffsr.inverse_dynamics(robot, kin, state.base_twist, state.joint_velocity, joint_acceleration)


def relative(ours, theirs) -> np.ndarray:
    """Norm of the difference over the norm of the reference, one a robot."""
    ours, theirs = np.asarray(ours), np.asarray(theirs)
    flat = (len(theirs), -1)
    difference = np.linalg.norm((ours - theirs).reshape(flat), axis=1)
    return difference / np.linalg.norm(theirs.reshape(flat), axis=1)


def against_mujoco(batch: Batch) -> Errors:
    """Inertia matrix, bias, forward and inverse dynamics, momentum and energy of MuJoCo, in our coordinates."""
    found = jax.device_get(evaluate(*batch.arguments))
    theirs = [
        _in_mujoco(robot, state, torque)
        for robot, state, torque in zip(batch.robots, batch.states, batch.torques, strict=True)
    ]
    theirs = {key: np.array([row[key] for row in theirs]) for key in theirs[0]}
    torque, base = inverse(stacked(batch.robots), stacked(batch.states), theirs["acceleration"][:, 6:])
    errors = {
        f"MuJoCo: {name}": relative(found[key], theirs[key])
        for name, key in (
            ("inertia matrix", "inertia"),
            ("bias force", "bias"),
            ("forward dynamics", "acceleration"),
            ("momentum", "momentum"),
            ("kinetic energy", "energy"),
            ("centre of mass", "system_com"),
            ("rollout, inverse locked inertia", "rollout_inertia"),
            ("rollout, base rate", "rollout_rate"),
            ("rollout, velocity of the centre", "rollout_com_velocity"),
        )
    }
    errors["MuJoCo: inverse dynamics, torque"] = relative(torque, batch.torques)
    errors["MuJoCo: inverse dynamics, base"] = relative(base, theirs["acceleration"][:, :6])
    return errors


def _in_mujoco(robot: Robot, state: State, torque: np.ndarray) -> dict[str, np.ndarray]:
    model = to_mjmodel(robot, 1e-3)
    data = mujoco.MjData(model)
    rotation = np.asarray(quaternion_to_matrix(state.base_quaternion))
    # MuJoCo numbers joints and motors along the branches of the tree, whatever order they were made in.
    names = robot.joint_names
    dofs = np.array([model.joint(name).dofadr[0] for name in names])
    motors = np.array([model.actuator(name).id for name in names])
    # A free joint's linear velocity is resolved in I, its angular velocity in B.
    data.qpos[:7] = np.concatenate([state.base_position, state.base_quaternion])
    data.qpos[dofs + 1] = state.joint_position
    data.qvel[:6] = np.concatenate([state.base_twist[:3], rotation.T @ state.base_twist[3:]])
    data.qvel[dofs] = state.joint_velocity
    data.ctrl[motors] = torque
    mujoco.mj_forward(model, data)
    mujoco.mj_subtreeVel(model, data)
    mujoco.mj_energyVel(model, data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    turn = np.zeros((model.nv, model.nv))
    turn[:3, :3], turn[3:6, 3:6] = np.eye(3), rotation
    turn[6 + np.arange(len(names)), dofs] = 1.0
    mass = model.body_subtreemass[1]
    linear = mass * data.subtree_linvel[1]
    inertia = turn @ inertia @ turn.T
    return {
        **_without_momentum(inertia, mass, data.subtree_com[1] - state.base_position, rotation, state),
        "inertia": inertia,
        "bias": turn @ data.qfrc_bias,
        "acceleration": turn @ data.qacc,
        "momentum": np.concatenate([linear, data.subtree_angmom[1]]),
        "energy": data.energy[1],
        "system_com": data.subtree_com[1].copy(),
    }


def _without_momentum(inertia, mass, lever, rotation, state: State) -> dict[str, np.ndarray]:
    """What the rollout takes from the joints, in B, worked out of an inertia matrix in I."""
    blocks, coupling = inertia[:6, :6], inertia[:6, 6:] @ state.joint_velocity
    locked = blocks[3:, 3:] - mass * (lever @ lever * np.eye(3) - np.outer(lever, lever))
    inverse = np.linalg.inv(rotation.T @ locked @ rotation)
    return {
        "rollout_inertia": inverse[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]],
        "rollout_rate": rotation.T @ -np.linalg.solve(blocks, coupling)[3:],
        "rollout_com_velocity": rotation.T @ coupling[:3] / mass,
    }


def symmetries(batch: Batch) -> Errors:
    """A rigid transform, a factor on all masses, and a factor on time change what they must and nothing else."""
    robots, states, torques = batch.arguments
    plain = jax.device_get(evaluate(robots, states, torques))
    errors = {"inverse of forward dynamics": relative(plain["torque"], torques)}
    errors["inverse of forward, base"] = relative(plain["base_acceleration"], plain["acceleration"][:, :6])

    turn, shift = random_quaternion(batch.rng), batch.rng.normal(size=3)
    rotation = np.asarray(quaternion_to_matrix(turn))
    moved = State(
        base_position=states.base_position @ rotation.T + shift,
        base_quaternion=np.asarray(jax.vmap(quaternion_multiply, (None, 0))(turn, states.base_quaternion)),
        joint_position=states.joint_position,
        base_twist=np.concatenate([part @ rotation.T for part in np.split(states.base_twist, 2, 1)], 1),
        joint_velocity=states.joint_velocity,
    )
    seen = jax.device_get(evaluate(robots, moved, torques))
    n = torques.shape[1]
    whole = np.eye(6 + n)
    whole[:3, :3] = whole[3:6, 3:6] = rotation
    errors["frame: inertia matrix"] = relative(seen["inertia"], whole @ plain["inertia"] @ whole.T)
    errors["frame: bias force"] = relative(seen["bias"], plain["bias"] @ whole.T)
    errors["frame: forward dynamics"] = relative(seen["acceleration"], plain["acceleration"] @ whole.T)
    errors["frame: momentum"] = relative(seen["momentum"], plain["momentum"] @ whole[:6, :6].T)
    errors["frame: kinetic energy"] = relative(seen["energy"], plain["energy"])

    factor = 3.7
    heavy = robots.replace(mass=factor * robots.mass, inertia=factor * robots.inertia)
    scaled = jax.device_get(evaluate(heavy, states, factor * torques))
    errors["mass: acceleration unchanged"] = relative(scaled["acceleration"], plain["acceleration"])
    for key in ("bias", "momentum", "energy", "inertia"):
        errors[f"mass: {key}"] = relative(scaled[key], factor * plain[key])

    quick = State(
        states.base_position,
        states.base_quaternion,
        states.joint_position,
        factor * states.base_twist,
        factor * states.joint_velocity,
    )
    fast = jax.device_get(evaluate(robots, quick, factor**2 * torques))
    for key, power in (("bias", 2), ("acceleration", 2), ("energy", 2), ("momentum", 1)):
        errors[f"time: {key}"] = relative(fast[key], factor**power * plain[key])
    return errors


@partial(jax.jit, static_argnums=2)
def coast(robots: Robot, states: State, num_steps: int):
    """Momentum (K, S, 6), kinetic energy and centre of mass along torque-free motions, and a size for momentum."""

    def one(robot, state):
        motion = jffsr.torque_rollout(robot, None, state, COAST_SECONDS, num_steps)
        samples = jax.tree.map(lambda x: x[:: num_steps // 20], motion.states)

        def read(state):
            kin = jffsr.kinematics(robot, state)
            velocities = state.base_twist, state.joint_velocity
            return (
                jffsr.momentum(robot, kin, *velocities),
                jffsr.kinetic_energy(robot, kin, *velocities),
                jffsr.system_com(robot, kin),
            )

        return jax.lax.map(read, samples)

    return jax.vmap(one)(robots, states)


def conservation(batch: Batch, num_steps: int) -> Errors:
    """Momentum and energy of torque-free motion over 10 s, and the straight line of the centre of mass."""
    rng = np.random.default_rng(batch.rng.integers(2**32))
    n = batch.torques.shape[1]
    states = stacked([random_state(rng, n, COASTING_SPEED) for _ in range(batch.count)])
    robots = stacked(batch.robots)
    momentum, energy, com = jax.device_get(coast(robots, states, num_steps))
    mass = robots.mass.sum(axis=1)
    # A momentum that happens to be small is measured against what its energy could carry.
    size = np.sqrt(2 * mass * energy[:, 0])
    reach = np.sqrt(np.trace(robots.inertia, axis1=2, axis2=3).sum(axis=1) / mass)
    linear = np.linalg.norm(momentum[..., :3] - momentum[:, :1, :3], axis=-1).max(axis=1) / size
    angular = np.linalg.norm(momentum[..., 3:] - momentum[:, :1, 3:], axis=-1).max(axis=1) / (size * reach)
    time = np.linspace(0, COAST_SECONDS, com.shape[1])[None, :, None]
    line = com[:, :1] + momentum[:, :1, :3] / mass[:, None, None] * time
    travelled = np.linalg.norm(com - line, axis=-1).max(axis=1) / (size / mass * COAST_SECONDS)
    return {
        "coasting 10 s: linear momentum": linear,
        "coasting 10 s: angular momentum": angular,
        "coasting 10 s: kinetic energy": np.abs(energy / energy[:, :1] - 1).max(axis=1),
        "coasting 10 s: centre of mass": travelled,
    }


def batch_of(seed: int, number: int, count: int) -> Batch:
    """Batch `number` of a seeded series: one topology, of 1 to 10 joints in turn, and `count` robots."""
    rng = np.random.default_rng((seed, number))
    topology = random_topology(rng, number % MOST_JOINTS + 1)
    return Batch(int(rng.integers(2**32)), topology, count)


def check(batch: Batch, num_steps: int) -> Errors:
    """Every law on one batch."""
    return against_mujoco(batch) | symmetries(batch) | conservation(batch, num_steps)
