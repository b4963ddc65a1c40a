"""What the estimators are compared on: captures with scattered targets, and a second piece that docks later."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

import jffsr
from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.reactionless.estimation.balance import Load
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.spatial.inertia import parallel_axis
from jffsr.spatial.rotation import quaternion_to_matrix


@dataclass(frozen=True)
class Scene:
    """A robot, its joints (n,) at the capture, rad, the axes of the base that it can hold, and the published-like
    target: mass, kg, moment of inertia, kg m^2, distance of its centre of mass from the tool, m, and spin, rad/s;
    planar: about z."""

    robot: Robot
    joints: tuple[float, ...]
    axes: tuple[int, ...]
    mass: float
    inertia: float
    distance: float
    spin: float
    piece_mass: float
    piece_inertia: float
    piece_distance: float
    planar: bool


PLANAR = Scene(
    jffsr.load_robot("ye_2019_planar3"), (0.0, 0.0, 0.0), (2,), 5.0, 2.5, 0.1, 0.5, 3.0, 1.0, 0.5, True
)
SPATIAL = Scene(
    jffsr.load_robot("servicer_7dof"),
    tuple(np.deg2rad([0.0, -60.0, 0.0, 45.0, 0.0, -15.0, 0.0])),
    (0, 1, 2),
    40.0,
    4.0,
    0.3,
    0.1,
    20.0,
    2.0,
    0.4,
    False,
)


def together(a: Load, b: Load) -> Load:
    """Two loads of one frame as one."""
    mass = a.mass + b.mass
    com = (a.mass * a.com + b.mass * b.com) / mass
    parts = [x.inertia + x.mass * parallel_axis(x.com - com) for x in (a, b)]
    return Load(mass, com, parts[0] + parts[1])


def draw(scene: Scene, seed: int) -> dict:
    """Target and second piece of a seed, as numbers: every size within 40 % of the scene's, directions at random."""
    rng = np.random.default_rng(seed)

    def near(value: float) -> float:
        return value * rng.uniform(0.6, 1.4)

    def direction() -> np.ndarray:
        found = rng.normal(size=3) * (np.array([1.0, 1.0, 0.0]) if scene.planar else 1.0)
        return found / np.linalg.norm(found)

    def moments(value: float) -> np.ndarray:
        return np.diag([near(value)] * 3) if scene.planar else np.diag(value * rng.uniform(0.8, 1.4, size=3))

    axis = np.array([0.0, 0.0, 1.0]) if scene.planar else direction()
    first = Load(near(scene.mass), near(scene.distance) * direction(), moments(scene.inertia))
    piece = Load(
        near(scene.piece_mass), near(scene.piece_distance) * direction(), moments(scene.piece_inertia)
    )
    return {"first": first, "piece": piece, "spin": near(scene.spin) * axis}


def captured(scene: Scene, drawn: dict) -> dict:
    """Loads in the tool frame, joint rates and angular momentum right after a plastic capture with free joints."""
    robot, first = scene.robot, drawn["first"]
    n = robot.num_joints
    state = State(
        jnp.zeros(3), jnp.array([1.0, 0, 0, 0]), jnp.asarray(scene.joints), jnp.zeros(6), jnp.zeros(n)
    )
    tool, quaternion = end_effector_pose(robot, kinematics(robot, state))
    target = jffsr.Target.create(first.inertia, first.mass)
    centre = tool + quaternion_to_matrix(quaternion) @ first.com
    turning = jffsr.TargetState.create(
        centre, jnp.zeros(3), quaternion, quaternion_to_matrix(quaternion).T @ drawn["spin"]
    )
    found = jffsr.grasped(robot, state, target, turning)
    return {
        "first": first,
        "second": together(first, drawn["piece"]),
        "rates": found.state.joint_velocity,
        "momentum": found.momentum[3:],
    }


def captures(scene: Scene, seeds: list[int]) -> dict:
    """The same of many seeds, with a leading axis."""
    drawn = [draw(scene, seed) for seed in seeds]
    stacked = jax.tree.map(lambda *x: jnp.stack([jnp.asarray(v, dtype=float) for v in x]), *drawn)
    return jax.jit(jax.vmap(lambda one: captured(scene, one)))(stacked)
