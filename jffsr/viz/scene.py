"""Where a robot's parts are at chosen instants, as points and segments ready to draw."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import jax
import numpy as np

from jffsr.compiling import program
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

    time (N + 1,), s; origin (N + 1, b, 3) and rotation (N + 1, b, 3, 3), the frames of the bodies; base_faces
    (N + 1, 6, 4, 3), the corners of a box with the base's inertia; joints and joint_axes (N + 1, n, 3);
    segments (N + 1, s, 2, 3), the links as straight lines from joint to joint and to the tools, and the body
    that each belongs to, owners (s,); tools (N + 1, m, 3) and tool_rotation (N + 1, m, 3, 3); com (N + 1, 3),
    the system's centre of mass. `planar` says that nothing ever leaves the x-y plane.
    """

    time: np.ndarray
    origin: np.ndarray
    rotation: np.ndarray
    base_faces: np.ndarray
    joints: np.ndarray
    joint_axes: np.ndarray
    segments: np.ndarray
    owners: np.ndarray
    tools: np.ndarray
    tool_rotation: np.ndarray
    com: np.ndarray
    planar: bool

    @property
    def base_position(self) -> np.ndarray:
        """Where the base's centre of mass is, (N + 1, 3)."""
        return self.origin[:, 0]

    @property
    def base_rotation(self) -> np.ndarray:
        """How the base is turned, (N + 1, 3, 3), B to I."""
        return self.rotation[:, 0]


@program(once=True)
def _all_kinematics(robot, position, quaternion, joints):
    return jax.vmap(lambda r, q, j: kinematics(robot, State(r, q, j)))(position, quaternion, joints)


def scene_of(robot: Robot, dataset: Dataset) -> Scene:
    """The scene of a run's result.nc."""
    names = ("time", "base_position", "base_quaternion", "joint_position")
    return _scene(robot, *(dataset[name].values for name in names))


def scene_at(robot: Robot, postures: np.ndarray) -> Scene:
    """The scene of postures (k, n), base at the origin with the axes of I: one sample each, all at time zero."""
    count = len(postures)
    quaternions = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    return _scene(robot, np.zeros(count), np.zeros((count, 3)), quaternions, postures)


def _scene(robot: Robot, time, base_position, base_quaternion, joint_position) -> Scene:
    kin = jax.device_get(_all_kinematics(robot, base_position, base_quaternion, joint_position))
    box_axes, sides = base_box(robot)
    corners = np.array(list(product((-0.5, 0.5), repeat=3))) * sides @ box_axes.T
    base_faces = kin.origin[:, 0, None, None] + np.einsum(
        "tij,fcj->tfci", kin.rotation[:, 0], corners[_FACES]
    )
    bodies = list(robot.topology.end_effector_bodies)
    tools = kin.origin[:, bodies] + np.einsum(
        "tmij,mj->tmi", kin.rotation[:, bodies], np.asarray(robot.end_effector_position)
    )
    owners, segments = _segments(robot, kin, tools, box_axes, sides)
    return Scene(
        time=time,
        origin=kin.origin,
        rotation=kin.rotation,
        base_faces=base_faces,
        joints=kin.anchor,
        joint_axes=kin.axis,
        segments=segments,
        owners=owners,
        tools=tools if bodies else kin.com[:, -1:],
        tool_rotation=kin.rotation[:, bodies] @ np.asarray(robot.end_effector_rotation),
        com=np.einsum("b,tbi->ti", robot.mass, kin.com) / np.sum(robot.mass),
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


def _segments(robot: Robot, kin, tools, box_axes, sides) -> tuple[np.ndarray, np.ndarray]:
    """The links as lines: the body that each belongs to (s,), and its two ends (N + 1, s, 2, 3)."""
    topology, found = robot.topology, []
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
        found.append((parent, start, anchor))
        found.append((joint + 1, anchor, kin.origin[:, joint + 1]))  # the way a sliding joint has gone
        if joint + 1 not in ended:
            found.append((joint + 1, kin.origin[:, joint + 1], kin.com[:, joint + 1]))
    for tool, body in enumerate(topology.end_effector_bodies):
        found.append((body, kin.origin[:, body], tools[:, tool]))
    ends = np.stack([np.stack([start, end], axis=1) for _, start, end in found], axis=1)
    return np.array([body for body, _, _ in found]), ends


def _is_planar(robot: Robot, kin) -> bool:
    along_z = np.abs(kin.axis[..., 2])
    return bool(np.all(np.where(robot.topology.is_revolute, 1.0 - along_z, along_z) < 1e-6))
