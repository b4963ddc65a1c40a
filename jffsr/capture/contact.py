"""Momentum handed over where a free-floating robot and a free target touch, in a time too short to move.

Both are described by generalized velocities, so that an impulse wrench W on the robot at the contact point changes them
by M_r^-1 J_r' W and -M_t^-1 J_t' W; W is what gives the relative velocity in chosen directions its value afterwards
(F. Pfeiffer and C. Glocker, "Multibody Dynamics with Unilateral Contacts", 1996; for space robots K. Yoshida and
N. Sashida, "Modeling of impact dynamics and impulse minimization for space robots", 1993).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np

from jffsr.capture.contact_bodies import (
    JOINTS_FREE,
    Meeting,
    contact_inertias,
    meeting_energy,
    meeting_momentum,
)
from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.robots.lumping import on_host, to_array
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.spatial.rotation import quaternion_to_matrix
from jffsr.target.body import Target
from jffsr.target.target_state import TargetState
from jffsr.types import Array, Vector3

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
"""Translations along and rotations about the axes of the end effector's frame."""


@register_dataclass
@dataclass(frozen=True, eq=False)
class Contact:
    """What an impact leaves behind.

    impulse (6,), [N s; N m s], of the target on the robot at the point (3,), m, both in I; state and target_state, the
    same poses with the velocities afterwards; momentum_before (6,) and momentum_after (6,), of both together: P, then
    L about their common centre of mass, in I; energy_lost (), J.
    """

    impulse: Array
    point: Array
    state: State
    target_state: TargetState
    momentum_before: Array
    momentum_after: Array
    energy_lost: Array


def grasp_impact(
    robot: Robot,
    state: State,
    target: Target,
    target_state: TargetState,
    end_effector: str | None = None,
    directions: Sequence[str] = DIRECTIONS,
    joints: str = JOINTS_FREE,
) -> Contact:
    """A plastic impact at the end effector: in these directions of its frame it moves afterwards as the target does.

    All six are a rigid grasp; others pass no impulse. With joints "free" no joint torque acts meanwhile; with "locked"
    the joint rates stay what they are, and their drives do work unless these are zero. The target's mass and inertia
    must be in kg and kg m^2. Raises InputError for unknown directions, joints and end effectors.
    """
    unknown = [d for d in directions if d not in DIRECTIONS]
    if unknown or not directions or len(set(directions)) < len(tuple(directions)):
        raise InputError(
            f"grasp impact: directions are {tuple(directions)}; allowed are some of {', '.join(DIRECTIONS)}, each once"
        )
    meeting = Meeting.create(robot, state, target, target_state, end_effector, joints)
    rotation = quaternion_to_matrix(meeting.tool_quaternion)
    axes = jnp.kron(jnp.eye(2), rotation.T)
    rows = axes[np.array([DIRECTIONS.index(d) for d in directions])]
    inertia = contact_inertias(meeting)
    relative = rows @ meeting.relative_twist
    impulse = -rows.T @ jnp.linalg.solve(rows @ sum(inertia) @ rows.T, relative)
    return _after(meeting, impulse)


def point_impact(
    robot: Robot,
    state: State,
    target: Target,
    target_state: TargetState,
    normal: Vector3,
    restitution: float = 0.0,
    point: Vector3 | None = None,
    end_effector: str | None = None,
    joints: str = JOINTS_FREE,
) -> Contact:
    """A frictionless impact of the end effector's body on the target in one point, after Newton's law of restitution.

    normal (3,), in I, of any length, from the target to the robot; restitution in [0, 1]: the share of the approach
    velocity along the normal with which they part; point (3,), m, in I, by default the tool's. Where they do not
    approach there is no impulse. Raises InputError for a restitution out of its range and a normal of no length, where
    these have numbers.
    """
    normal = to_array(normal)
    numbers = on_host(normal, to_array(restitution))
    if normal.shape != (3,) or (numbers is not None and not np.linalg.norm(numbers[0]) > 0):
        raise InputError(f"point impact: normal is {normal!r}; a vector (3,) of some length is expected")
    if numbers is not None and not 0 <= numbers[1] <= 1:
        raise InputError(f"point impact: restitution is {numbers[1]:g}; a number in [0, 1] is expected")
    meeting = Meeting.create(robot, state, target, target_state, end_effector, joints, point)
    row = jnp.concatenate([normal / jnp.sqrt(normal @ normal), jnp.zeros(3)])
    approach = jnp.minimum(row @ meeting.relative_twist, 0.0)
    size = -(1 + restitution) * approach / (row @ sum(contact_inertias(meeting)) @ row)
    return _after(meeting, size * row)


def _after(meeting: Meeting, impulse: Array) -> Contact:
    """Both after an impulse wrench (6,) on the robot at the contact point, and its opposite on the target."""
    change, target_change = meeting.changes(impulse)
    state, target_state = meeting.state, meeting.target_state
    back = quaternion_to_matrix(target_state.quaternion).T
    new_state = replace(
        state,
        base_twist=meeting.base_twist + change[:6],
        joint_velocity=meeting.joint_velocity + change[6:],
    )
    new_target = replace(
        target_state,
        velocity=target_state.velocity + target_change[:3],
        angular_velocity_T=target_state.angular_velocity_T + back @ target_change[3:],
    )
    later = meeting.with_velocities(new_state, new_target)
    return Contact(
        impulse=impulse,
        point=meeting.point,
        state=new_state,
        target_state=new_target,
        momentum_before=meeting_momentum(meeting),
        momentum_after=meeting_momentum(later),
        energy_lost=meeting_energy(meeting) - meeting_energy(later),
    )
