"""Where a robot's parts are at chosen instants, as points and segments ready to draw."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import jax
import numpy as np

from jffsr.dynamics.kinematics import kinematics
from jffsr.robots.robot import Robot
from jffsr.robots.state import State

if TYPE_CHECKING:
    from xarray import Dataset

# Corners of each face of a box, as indices of its corners in the order of itertools.product.
_FACES = np.array([[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]])


@dataclass(frozen=True)
class Scene:
    """Parts of a robot at every sample of a run, all in I and in m.

    time (N + 1,), s; base_position (N + 1, 3); base_rotation (N + 1, 3, 3); base_faces (N + 1, 6, 4, 3), the
    corners of a box with the base's inertia; joints (N + 1, n, 3); segments (N + 1, s, 2, 3), the links as
    straight lines from joint to joint and to the tools; tools (N + 1, m, 3). `planar` says that nothing ever
    leaves the x-y plane.
    """

    time: np.ndarray
    base_position: np.ndarray
    base_rotation: np.ndarray
    base_faces: np.ndarray
    joints: np.ndarray
    segments: np.ndarray
    tools: np.ndarray
    planar: bool


@jax.jit
def _all_kinematics(robot, position, quaternion, joints):
    return jax.vmap(lambda r, q, j: kinematics(robot, State(r, q, j)))(position, quaternion, joints)


def scene_of(robot: Robot, dataset: Dataset) -> Scene:
    """The scene of a run's result.nc."""
    kin = jax.device_get(
        _all_kinematics(
            robot,
            dataset["base_position"].values,
            dataset["base_quaternion"].values,
            dataset["joint_position"].values,
        )
    )
    box_axes, sides = base_box(robot)
    corners = np.array(list(product((-0.5, 0.5), repeat=3))) * sides @ box_axes.T
    base_faces = kin.origin[:, 0, None, None] + np.einsum(
        "tij,fcj->tfci", kin.rotation[:, 0], corners[_FACES]
    )
    topology = robot.topology
    tools = np.stack(
        [
            kin.origin[:, body] + kin.rotation[:, body] @ np.asarray(place)
            for body, place in zip(topology.end_effector_bodies, robot.end_effector_position, strict=True)
        ]
        or [kin.com[:, -1]],
        axis=1,
    )
    return Scene(
        time=dataset["time"].values,
        base_position=kin.origin[:, 0],
        base_rotation=kin.rotation[:, 0],
        base_faces=base_faces,
        joints=kin.anchor,
        segments=_segments(robot, kin, tools, box_axes, sides),
        tools=tools,
        planar=_is_planar(robot, kin),
    )


def base_box(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    """Axes (3, 3), columns in B, and sides (3,), m, of the uniform box with the base's mass and inertia."""
    inertia, mass = np.asarray(robot.inertia[0]), float(robot.mass[0])
    off = np.abs(inertia - np.diag(np.diag(inertia))).max()
    # Rounding off the diagonal must not turn a cube.
    if off < 1e-6 * np.trace(inertia):
        moments, axes = np.diag(inertia), np.eye(3)
    else:
        moments, axes = np.linalg.eigh(inertia)
    squares = 6.0 / mass * (moments.sum() - 2.0 * moments)
    return axes, np.sqrt(np.maximum(squares, 0.0))


def _segments(robot: Robot, kin, tools: np.ndarray, box_axes: np.ndarray, sides: np.ndarray) -> np.ndarray:
    topology, segments = robot.topology, []
    ended = {*topology.parents, *topology.end_effector_bodies}
    for joint, parent in enumerate(topology.parents):
        anchor = kin.anchor[:, joint]
        if parent == 0:
            # From the nearest point of the box: nothing where the joint sits on it.
            place = np.asarray(robot.joint_position[joint]) @ box_axes
            mount = box_axes @ np.clip(place, -sides / 2, sides / 2)
            start = kin.origin[:, 0] + kin.rotation[:, 0] @ mount
        else:
            start = kin.origin[:, parent]
        segments.append((start, anchor))
        segments.append((anchor, kin.origin[:, joint + 1]))  # the way a sliding joint has gone
        if joint + 1 not in ended:
            segments.append((kin.origin[:, joint + 1], kin.com[:, joint + 1]))
    for tool, body in enumerate(topology.end_effector_bodies):
        segments.append((kin.origin[:, body], tools[:, tool]))
    return np.stack([np.stack(pair, axis=1) for pair in segments], axis=1)


def _is_planar(robot: Robot, kin) -> bool:
    along_z = np.abs(kin.axis[..., 2])
    return bool(np.all(np.where(robot.topology.is_revolute, 1.0 - along_z, along_z) < 1e-6))
