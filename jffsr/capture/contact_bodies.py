"""A robot and a target that touch in a point: their velocities there, their inertias felt there, what both have."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import jax.numpy as jnp

from jffsr.dynamics.kinematics import Kinematics, end_effector_pose, jacobians, kinematics, system_com
from jffsr.dynamics.momentum import inertia_blocks, kinetic_energy, momentum
from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.reading.did_you_mean import hint
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.spatial.inertia import skew
from jffsr.spatial.rotation import quaternion_to_matrix
from jffsr.target.body import Target
from jffsr.target.target_state import TargetState
from jffsr.types import Array, Matrix, Quaternion, Scalar, Twist, Vector3

JOINTS_FREE, JOINTS_LOCKED = "free", "locked"


@register_dataclass
@dataclass(frozen=True, eq=False)
class Meeting:
    """Both at the instant of contact, all resolved in I.

    robot, state and kin, its kinematics; base_twist (6,) and joint_velocity (n,), zero where the state has none; point
    (3,), m, of contact; tool_quaternion (4,), end effector to I; jacobian (6, 6 + n) of the velocity of the end
    effector's body at the point by [base twist; joint rates]; target and target_state; target_jacobian (6, 6) of the
    target's there by [velocity of its centre of mass; angular velocity]; `locked`, static, whether joint rates hold.
    """

    robot: Robot
    state: State
    kin: Kinematics
    base_twist: Twist
    joint_velocity: Array
    point: Vector3
    tool_quaternion: Quaternion
    jacobian: Matrix
    target: Target
    target_state: TargetState
    target_jacobian: Matrix
    locked: bool = field(metadata={"static": True})

    @classmethod
    def create(
        cls,
        robot: Robot,
        state: State,
        target: Target,
        target_state: TargetState,
        end_effector: str | None,
        joints: str,
        point: Vector3 | None = None,
    ) -> Meeting:
        """The meeting at a point (3,), m, in I, None for the end effector's own. InputError for unknown joints."""
        if joints not in (JOINTS_FREE, JOINTS_LOCKED):
            allowed = (JOINTS_FREE, JOINTS_LOCKED)
            raise InputError(
                f"contact: joints is {joints!r}; allowed are {' and '.join(map(repr, allowed))}{hint(joints, allowed)}"
            )
        kin = kinematics(robot, state)
        tool, quaternion = end_effector_pose(robot, kin, end_effector)
        point = tool if point is None else jnp.asarray(point)
        jacobian = _moved(point - tool) @ jnp.concatenate(jacobians(robot, kin, end_effector), axis=1)
        base_twist = jnp.zeros(6) if state.base_twist is None else jnp.asarray(state.base_twist)
        rates = jnp.zeros(robot.num_joints) if state.joint_velocity is None else state.joint_velocity
        return cls(
            robot,
            state,
            kin,
            base_twist,
            jnp.asarray(rates),
            point,
            quaternion,
            jacobian,
            target,
            target_state,
            _moved(point - target_state.position),
            joints == JOINTS_LOCKED,
        )

    def with_velocities(self, state: State, target_state: TargetState) -> Meeting:
        """The same place with other velocities."""
        return replace(
            self,
            state=state,
            base_twist=state.base_twist,
            joint_velocity=state.joint_velocity,
            target_state=target_state,
        )

    @property
    def target_twist(self) -> Twist:
        """Velocity of the target's centre of mass and its angular velocity (6,), in I."""
        rotation = quaternion_to_matrix(self.target_state.quaternion)
        turning = rotation @ jnp.asarray(self.target_state.angular_velocity_T)
        return jnp.concatenate([jnp.asarray(self.target_state.velocity), turning])

    @property
    def relative_twist(self) -> Twist:
        """Twist (6,) at the point of the end effector's body less that of the target."""
        own = self.jacobian @ jnp.concatenate([self.base_twist, self.joint_velocity])
        return own - self.target_jacobian @ self.target_twist

    @property
    def target_inertia(self) -> Matrix:
        """The target's inertia (3, 3) about its centre of mass, in I."""
        rotation = quaternion_to_matrix(self.target_state.quaternion)
        return rotation @ self.target.inertia @ rotation.T

    def changes(self, impulse: Array) -> tuple[Array, Array]:
        """Changes of [base twist; joint rates] (6 + n,) and of the target's twist (6,) by an impulse wrench (6,), or
        by the columns of (6, k), on the robot at the point, with its opposite on the target."""
        h_b, h_bm, h_m = inertia_blocks(self.robot, self.kin)
        if self.locked:
            base = jnp.linalg.solve(h_b, self.jacobian[:, :6].T @ impulse)
            change = jnp.concatenate([base, jnp.zeros((self.robot.num_joints, *impulse.shape[1:]))])
        else:
            inertia = jnp.block([[h_b, h_bm], [h_bm.T, h_m]])
            change = jnp.linalg.solve(inertia, self.jacobian.T @ impulse)
        wrench = -self.target_jacobian.T @ impulse
        turned = jnp.linalg.solve(self.target_inertia, wrench[3:])
        return change, jnp.concatenate([wrench[:3] / self.target.mass, turned])


def contact_inertias(meeting: Meeting) -> tuple[Matrix, Matrix]:
    """Inverse inertias (6, 6) of the robot and of the target at the point: twist there per impulse wrench."""
    change, target_change = meeting.changes(jnp.eye(6))
    return meeting.jacobian @ change, -meeting.target_jacobian @ target_change


def meeting_momentum(meeting: Meeting) -> Twist:
    """Momentum (6,) of both together: P, N s, then L about their common centre of mass, N m s, in I."""
    own = momentum(meeting.robot, meeting.kin, meeting.base_twist, meeting.joint_velocity)
    mass, com = jnp.sum(jnp.asarray(meeting.robot.mass)), system_com(meeting.robot, meeting.kin)
    linear = meeting.target.mass * meeting.target_twist[:3]
    spin = meeting.target_inertia @ meeting.target_twist[3:]
    position = meeting.target_state.position
    centre = (mass * com + meeting.target.mass * position) / (mass + meeting.target.mass)
    angular = own[3:] + jnp.cross(com - centre, own[:3]) + spin + jnp.cross(position - centre, linear)
    return jnp.concatenate([own[:3] + linear, angular])


def meeting_energy(meeting: Meeting) -> Scalar:
    """Kinetic energy (), J, of both together."""
    own = kinetic_energy(meeting.robot, meeting.kin, meeting.base_twist, meeting.joint_velocity)
    velocity, rate = meeting.target_twist[:3], meeting.target_twist[3:]
    return own + 0.5 * (meeting.target.mass * velocity @ velocity + rate @ meeting.target_inertia @ rate)


def _moved(lever: Vector3) -> Matrix:
    """Matrix (6, 6) from a twist to that of the same body in a point farther by the lever (3,)."""
    eye, zero = jnp.eye(3), jnp.zeros((3, 3))
    return jnp.block([[eye, -skew(lever)], [zero, eye]])
