"""Forward kinematics of the joints between base and tool, written for batches.

Every number is a scalar of its own, so that under vmap each becomes one long array over the batch and every
operation one loop over it (`spatial.components`). `jffsr.kinematics` is the readable version and the test.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jffsr.robots.robot import Robot
from jffsr.rollouts.hot_path import joint_constants
from jffsr.spatial.components import Components, Rows, add, cross, rows_product, rows_times, scale, subtract
from jffsr.spatial.rotation import frame_along
from jffsr.spatial.trigonometry import sine_cosine
from jffsr.types import Array

Four = tuple[Array, Array, Array, Array]
"""Components w, x, y, z of a quaternion."""


class ToolPose(NamedTuple):
    """Tool position, m, and quaternion in B, and one column [linear; angular] of its Jacobian for each joint."""

    position: Components
    quaternion: Four
    columns: tuple[tuple[Array, ...], ...]


class Chain(NamedTuple):
    """The way from base to tool in frames whose z is the joint's axis; static and in order from the base.

    joints, their indices in the robot; turning, whether each is revolute; offsets and rotations, each joint's frame in
    that of the one before at joint position zero; tool_position and tool_rotation, the tool in the last joint's frame.
    """

    joints: tuple[int, ...]
    turning: tuple[bool, ...]
    offsets: tuple[Components, ...]
    rotations: tuple[Rows, ...]
    tool_position: Components
    tool_rotation: Rows


def chain_to_tool(robot: Robot, end_effector: str | None = None) -> Chain:
    """The joints that move an end effector; InputError for one that the robot does not have."""
    index = robot.end_effector_index(end_effector)
    body = robot.topology.end_effector_bodies[index]
    joints = tuple(int(j) for j in robot.topology.support[body].nonzero()[0])
    constants = joint_constants(robot)
    last = frame_along(jnp.asarray(robot.joint_axis)[joints[-1]]) if joints else jnp.eye(3)
    return Chain(
        joints=joints,
        turning=tuple(bool(robot.topology.is_revolute[j]) for j in joints),
        offsets=tuple(tuple(constants.offset[j]) for j in joints),
        rotations=tuple(_rows(constants.rotation[j]) for j in joints),
        tool_position=tuple(last.T @ jnp.asarray(robot.end_effector_position)[index]),
        tool_rotation=_rows(last.T @ jnp.asarray(robot.end_effector_rotation)[index]),
    )


def _rows(matrix: Array) -> Rows:
    return tuple(tuple(matrix[r, k] for k in range(3)) for r in range(3))


def chain_length(chain: Chain) -> Array:
    """Length (), m, of the way from the first joint to the tool, slides not counted."""
    parts = [*chain.offsets[1:], chain.tool_position]
    return sum(jnp.sqrt(x * x + y * y + z * z) for x, y, z in parts)


def tool_pose(chain: Chain, q: tuple[Array, ...]) -> ToolPose:
    """The tool in B, and its Jacobian with the base held, at positions of the chain's joints."""
    zero, one = jnp.zeros_like(q[0]), jnp.ones_like(q[0])
    position: Components = (zero, zero, zero)
    rotation: Rows = ((one, zero, zero), (zero, one, zero), (zero, zero, one))
    anchors, axes = [], []
    for k, angle in enumerate(q):
        position = add(position, rows_times(rotation, chain.offsets[k]))
        rotation = rows_product(rotation, chain.rotations[k])
        axis = tuple(row[2] for row in rotation)
        anchors.append(position)
        axes.append(axis)
        if chain.turning[k]:
            s, c = sine_cosine(angle)
            rotation = tuple((c * x + s * y, c * y - s * x, z) for x, y, z in rotation)
        else:
            position = add(position, scale(angle, axis))
        position, rotation = jax.lax.optimization_barrier((position, rotation))
    position = add(position, rows_times(rotation, chain.tool_position))
    rotation = rows_product(rotation, chain.tool_rotation)
    columns = tuple(
        (*cross(axis, subtract(position, anchor)), *axis) if turns else (*axis, zero, zero, zero)
        for turns, axis, anchor in zip(chain.turning, axes, anchors, strict=True)
    )
    return ToolPose(*jax.lax.optimization_barrier((position, rows_to_quaternion(rotation), columns)))


def rows_to_quaternion(m: Rows) -> Four:
    """Unit quaternion of a rotation, from the row of 4 q q' with the largest diagonal element (Shepperd 1978)."""
    trace = m[0][0] + m[1][1] + m[2][2]
    wx, wy, wz = m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]
    xy, xz, yz = m[0][1] + m[1][0], m[0][2] + m[2][0], m[1][2] + m[2][1]
    ww, xx, yy, zz = (
        1 + trace,
        1 + 2 * m[0][0] - trace,
        1 + 2 * m[1][1] - trace,
        1 + 2 * m[2][2] - trace,
    )
    best, row = ww, (ww, wx, wy, wz)
    for diagonal, other in (
        (xx, (wx, xx, xy, xz)),
        (yy, (wy, xy, yy, yz)),
        (zz, (wz, xz, yz, zz)),
    ):
        larger = diagonal > best
        best = jnp.where(larger, diagonal, best)
        row = tuple(jnp.where(larger, a, b) for a, b in zip(other, row, strict=True))
    length = jnp.sqrt(row[0] ** 2 + row[1] ** 2 + row[2] ** 2 + row[3] ** 2)
    return tuple(a / length for a in row)


def turn_between(wanted: Four, actual: Four) -> Components:
    """Rotation vector, rad, in the parent frame, that takes the actual attitude to the wanted one.

    Its length is at most pi; at 180 degrees it is one of the two.
    """
    aw, ax, ay, az = wanted
    bw, bx, by, bz = actual[0], -actual[1], -actual[2], -actual[3]
    w = aw * bw - ax * bx - ay * by - az * bz
    v = (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )
    sign = jnp.where(w < 0, -1.0, 1.0)
    squared = v[0] ** 2 + v[1] ** 2 + v[2] ** 2
    # Below this the arc's series is exact to rounding; both branches must stay finite for gradients.
    small = squared < 1e-10
    length = jnp.sqrt(jnp.where(small, 1.0, squared))
    factor = jnp.where(small, 2 + squared / 3, 2 * jnp.arctan2(length, jnp.abs(w)) / length)
    return scale(sign * factor, v)
