"""Forward kinematics of the joints between base and tool, written for batches.

The joints are one loop, so that it compiles once, and every number in it is a scalar of its own, so that under vmap
each becomes one long array over the batch and every operation one loop over that (`spatial.components`).
`jffsr.kinematics` is the readable version and the test.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.robots.robot import Robot
from jffsr.rollouts.hot_path import joint_constants
from jffsr.spatial.components import Components, Rows, add, cross, rows_product, rows_times, scale, subtract
from jffsr.spatial.rotation import frame_along
from jffsr.spatial.trigonometry import sine_cosine
from jffsr.types import Array

Four = tuple[Array, Array, Array, Array]
"""Components w, x, y, z of a quaternion."""


class ToolPose(NamedTuple):
    """Tool position, m, and quaternion in B, and the rows of its Jacobian [linear; angular], (k,) each."""

    position: Components
    quaternion: Four
    rows: tuple[Array, ...]


class Chain(NamedTuple):
    """The k joints from base to tool, in order, in frames whose z is the joint's axis.

    joints, their indices in the robot, and turning, whether each is revolute, are static; offset (k, 3), m, and
    rotation (k, 3, 3), each joint's frame in that of the one before at joint position zero; tool_position (3,) and
    tool_rotation (3, 3), the tool in the last joint's frame; lower and upper (k,), the joints' limits.
    """

    joints: tuple[int, ...]
    turning: tuple[bool, ...]
    offset: Array
    rotation: Array
    tool_position: Array
    tool_rotation: Array
    lower: Array
    upper: Array

    @property
    def index(self) -> np.ndarray:
        """The joints' indices (k,) in the robot."""
        return np.array(self.joints)

    @property
    def length(self) -> Array:
        """Length (), m, of the way from the first joint to the tool, slides not counted."""
        parts = jnp.concatenate([self.offset[1:], self.tool_position[None]])
        return jnp.sum(jnp.linalg.norm(parts, axis=1))


def chain_to_tool(robot: Robot, end_effector: str | None = None) -> Chain:
    """The joints that move an end effector; InputError for one that the robot does not have."""
    index = robot.end_effector_index(end_effector)
    body = robot.topology.end_effector_bodies[index]
    joints = np.flatnonzero(robot.topology.support[body])
    constants = joint_constants(robot)
    last = frame_along(jnp.asarray(robot.joint_axis)[joints[-1]])
    return Chain(
        joints=tuple(map(int, joints)),
        turning=tuple(map(bool, robot.topology.is_revolute[joints])),
        offset=constants.offset[joints],
        rotation=constants.rotation[joints],
        tool_position=last.T @ jnp.asarray(robot.end_effector_position)[index],
        tool_rotation=last.T @ jnp.asarray(robot.end_effector_rotation)[index],
        lower=jnp.asarray(robot.limits.position_lower)[joints],
        upper=jnp.asarray(robot.limits.position_upper)[joints],
    )


def _rows(matrix: Array) -> Rows:
    return tuple(tuple(matrix[r, k] for k in range(3)) for r in range(3))


def tool_pose(chain: Chain, q: Array) -> ToolPose:
    """The tool in B, and its Jacobian with the base held, at positions (k,) of the chain's joints."""
    one = jnp.ones_like(q[0])
    zero = one * 0
    eye = tuple(tuple(one if r == k else zero for k in range(3)) for r in range(3))
    mixed = len(set(chain.turning)) > 1
    inputs = (q, chain.offset, chain.rotation) + ((np.array(chain.turning),) if mixed else ())

    def outwards(carried, joint):
        position, rotation = carried
        angle, offset, turned = joint[:3]
        anchor = add(position, rows_times(rotation, tuple(offset)))
        rotation = rows_product(rotation, _rows(turned))
        axis = tuple(row[2] for row in rotation)
        turn = jnp.where(joint[3], angle, 0.0) if mixed else angle
        position = anchor
        if mixed or not chain.turning[0]:
            position = add(anchor, scale(angle - turn if mixed else angle, axis))
        if mixed or chain.turning[0]:
            s, c = sine_cosine(turn)
            rotation = tuple((c * x + s * y, c * y - s * x, z) for x, y, z in rotation)
        return jax.lax.optimization_barrier((position, rotation)), (anchor, axis)

    (position, rotation), (anchor, axis) = jax.lax.scan(outwards, ((zero,) * 3, eye), inputs)
    position = add(position, rows_times(rotation, tuple(chain.tool_position)))
    rotation = rows_product(rotation, _rows(chain.tool_rotation))
    turns = np.array(chain.turning)
    swing = cross(axis, subtract(position, anchor))
    if turns.all():
        rows = (*swing, *axis)
    else:
        rows = (
            *(jnp.where(turns, a, b) for a, b in zip(swing, axis, strict=True)),
            *(jnp.where(turns, a, 0.0) for a in axis),
        )
    return ToolPose(*jax.lax.optimization_barrier((position, rows_to_quaternion(rotation), rows)))


def rows_to_quaternion(m: Rows) -> Four:
    """Unit quaternion of a rotation, from the row of 4 q q' with the largest diagonal element (Shepperd 1978)."""
    trace = m[0][0] + m[1][1] + m[2][2]
    wx, wy, wz = m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]
    xy, xz, yz = m[0][1] + m[1][0], m[0][2] + m[2][0], m[1][2] + m[2][1]
    xx, yy, zz = (1 + 2 * m[k][k] - trace for k in range(3))
    best, row = 1 + trace, (1 + trace, wx, wy, wz)
    for diagonal, other in ((xx, (wx, xx, xy, xz)), (yy, (wy, xy, yy, yz)), (zz, (wz, xz, yz, zz))):
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
