"""Passivity-based adaptive control of the joints of a free-floating robot with an unknown load.

Slotine and Li, "On the adaptive control of robot manipulators", Int. J. Robotics Research 6(3), 1987, on the joint rows
of the whole system's equations. The base is not eliminated: that would make the equations nonlinear in the load. Its
motion enters as measured instead,

    H_bm' nudot + H_m qdd + c_m(v) = tau,    v = [nu; qd],

whose left side is linear in the load's ten inertial parameters theta. Let e = q_d - q, qd_r = qd_d + Lambda e,
r = qd_r - qd, and let C be the polar form of the bias force, C(v, w) = (c_m(v + w) - c_m(v - w))/4, so that
C(v, v) = c_m(v). Because joint velocities are rates of coordinates, C(v, [0; r]) = C_m r holds the Christoffel symbols
of H_m along the joints, and d/dt H_m - 2 C_m is skew, whatever the base does. With

    tau = Y theta + known robot's share + K r,    Y theta = H_bm' nudot + H_m qdd_r + c_m(v) + C(v, [0; r]) of the load,

the closed loop is H_m rdot = -C_m r - K r + Y (theta - theta_hat), and with theta_hat' = Gamma Y' r

    V = r' H_m r/2 + (theta - theta_hat)' Gamma^-1 (theta - theta_hat)/2,    V' = -r' K r.

So r falls to zero with the right load or another that explains the motion as well. What it assumes: that the base's
angular velocity and both its accelerations are measured, at the instant. Its linear velocity is not needed (Galileo).
A sampled accelerometer tells the last period's mean, and since the torque itself accelerates the base, using that as it
is would be a loop with one sample of delay whose gain is the largest eigenvalue g of H_m H*^-1 - 1, above one where the
base is light. It is smoothed first, nudot_f' = (nudot - nudot_f)/smoothing, which in samples is stable for
period/(period + smoothing) < 2/(1 + g). The joints then feel their inertia H* at once and H_m after that time; as
Delta s/(1 + s smoothing) with Delta = H_m - H* > 0 is positive real, small motions stay passive. A constant torque
beside the load in each joint, a disturbance, is estimated in the same way, its regressor being one.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp

from jffsr.dynamics.equations_of_motion import body_wrenches
from jffsr.dynamics.kinematics import Kinematics, kinematics
from jffsr.dynamics.momentum import generalized_inertia
from jffsr.dynamics.spatial_tree import inwards, motion_subspace, spatial_inertias
from jffsr.pytrees import register_dataclass
from jffsr.reactionless.control.errors import Gains, tracking_errors
from jffsr.reactionless.control.load_inertia import LOAD_PARAMETERS, load_inertias
from jffsr.reactionless.interface import Desired, Measured
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.types import Array, Scalar, Twist, Vector


@register_dataclass
@dataclass(frozen=True)
class LoadEstimate:
    """parameters (10,) of the load, theta_hat; bias (n,), constant torques that the joints need beside it, N m or N;
    the smoothed base_acceleration (6,)."""

    parameters: Array
    bias: Array
    base_acceleration: Array


@register_dataclass
@dataclass(frozen=True)
class PassivityBased:
    """The module's law: the robot without load, a load of unknown inertia on the body of its first end effector.

    adaptation (10,) is Gamma's diagonal, in the parameters' units squared per J; start (10,), the first estimate, zero
    by default; bias_adaptation, N^2 m^2/J, that of the constant torques; smoothing, s, of the base's acceleration. K is
    the generalized inertia of the robot without load, scaled by the root of gains.rate from both sides, so that it is
    positive definite; period, s.
    """

    robot: Robot
    gains: Gains
    adaptation: Array
    start: Array
    bias_adaptation: Array | float = 100.0
    smoothing: Array | float = 0.5
    period: Array | float = 0.01

    @classmethod
    def of(
        cls,
        robot: Robot,
        gains: Gains | None = None,
        adaptation: Array | float = 1.0,
        start: Array | None = None,
        **options: Array | float,
    ) -> PassivityBased:
        """For the robot without load; InputError where it has no end effector or the gains do not fit."""
        gains = Gains.fitting(robot, gains)
        robot.end_effector_index(None)
        rates = jnp.broadcast_to(jnp.asarray(adaptation, dtype=float), (LOAD_PARAMETERS,))
        begin = jnp.zeros(LOAD_PARAMETERS) if start is None else jnp.asarray(start, dtype=float)
        return cls(robot, gains, rates, begin, **options)

    def begin(self, measured: Measured) -> LoadEstimate:
        """The load as first estimated, the base unaccelerated."""
        return LoadEstimate(
            jnp.asarray(self.start, dtype=float), jnp.zeros(self.robot.num_joints), jnp.zeros(6)
        )

    def advance(
        self, state: LoadEstimate, time: Scalar, measured: Measured, desired: Desired
    ) -> tuple[LoadEstimate, Vector]:
        """The next estimate of the load, and torques (n,)."""
        share = jnp.where(measured.fresh, self.period / (self.period + self.smoothing), 0.0)
        smooth = state.base_acceleration + share * (measured.base_acceleration - state.base_acceleration)
        errors = tracking_errors(measured, desired, self.gains.slope)
        r = errors.combined
        wanted = desired.joint_acceleration + self.gains.slope * errors.error_rate
        kin = kinematics(self.robot, State(jnp.zeros(3), measured.base_quaternion, errors.position))
        motion = (measured.base_rate, smooth, errors.velocity, wanted, r)
        known = reference_torque(self.robot, kin, spatial_inertias(self.robot, kin), *motion)
        regressor = load_regressor(self.robot, kin, *motion)
        root = jnp.sqrt(jnp.asarray(self.gains.rate))
        feedback = root * (generalized_inertia(self.robot, kin) @ (root * r))
        following = state.parameters + self.period * self.adaptation * (regressor.T @ r)
        bias = state.bias + self.period * self.bias_adaptation * r
        torque = known + regressor @ state.parameters + state.bias + feedback
        return LoadEstimate(following, bias, smooth), torque


def reference_torque(
    robot: Robot,
    kin: Kinematics,
    inertia: Array,
    base_rate: Vector,
    base_acceleration: Twist,
    joint_velocity: Vector,
    joint_acceleration: Vector,
    combined: Vector,
) -> Vector:
    """H_bm' nudot + H_m qdd_r + c_m(v) + C(v, [0; r]) (n,) of bodies with these spatial inertias (b, 6, 6).

    base_rate (3,) in I; base_acceleration (6,) is d/dt of the base twist in I; joint_acceleration qdd_r; combined r.
    """
    # The base counts as at rest in its instantaneous inertial frame, where spatial and ordinary accelerations agree.
    twist = jnp.concatenate([jnp.zeros(3), base_rate])
    still, none = jnp.zeros(6), jnp.zeros_like(joint_velocity)
    first = joint_torques(robot, kin, inertia, base_acceleration, twist, joint_velocity, joint_acceleration)
    ahead = joint_torques(robot, kin, inertia, still, twist, joint_velocity + combined, none)
    behind = joint_torques(robot, kin, inertia, still, twist, joint_velocity - combined, none)
    return first + (ahead - behind) / 4


def joint_torques(
    robot: Robot,
    kin: Kinematics,
    inertia: Array,
    base_acceleration: Twist,
    base_twist: Twist,
    joint_velocity: Vector,
    joint_acceleration: Vector,
) -> Vector:
    """Joint torques (n,) of bodies with spatial inertias (b, 6, 6) on a base that moves as told."""
    motion = motion_subspace(robot, kin)
    wrench = body_wrenches(
        robot, kin, inertia, motion, base_acceleration, base_twist, joint_velocity, joint_acceleration
    )
    return jnp.sum(motion * inwards(robot.topology.parents, wrench)[1:], axis=-1)


def load_regressor(
    robot: Robot,
    kin: Kinematics,
    base_rate: Vector,
    base_acceleration: Twist,
    joint_velocity: Vector,
    joint_acceleration: Vector,
    combined: Vector,
) -> Array:
    """Y (n, 10): `reference_torque` per parameter of a load on the body of the first end effector."""
    body = robot.topology.end_effector_bodies[0]
    motion = (base_rate, base_acceleration, joint_velocity, joint_acceleration, combined)

    def torque(parameters: Vector) -> Vector:
        return reference_torque(robot, kin, load_inertias(robot, kin, body, parameters), *motion)

    return jax.vmap(torque, out_axes=1)(jnp.eye(LOAD_PARAMETERS))
