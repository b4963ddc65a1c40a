"""Tracking errors as all controllers here read them, and the gains that go with them."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from jffsr.dynamics.kinematics import kinematics
from jffsr.dynamics.momentum import generalized_inertia
from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.reactionless.interface import Desired, Measured
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.types import Array, Vector


@register_dataclass
@dataclass(frozen=True)
class Gains:
    """K (n,), 1/s, and Lambda (n,), 1/s, diagonal: an error dies out as exp(-Lambda t) once r = 0, r as exp(-K t)."""

    rate: Array
    slope: Array

    @classmethod
    def published(cls, num_joints: int) -> Gains:
        """diag(100, 50, 50, ...) and diag(2, 1, 1, ...); Ye, Dong and Hong 2019, Table 2, print two of each."""
        if num_joints < 1:
            raise InputError(f"num_joints is {num_joints}; at least one is expected")
        first = np.arange(num_joints) == 0
        return cls(np.where(first, 100.0, 50.0), np.where(first, 2.0, 1.0))

    @classmethod
    def fitting(cls, robot: Robot, gains: Gains | None) -> Gains:
        """The gains, None the published ones; InputError where they are not one a joint."""
        n = robot.num_joints
        if gains is None:
            return cls.published(n)
        for name in ("rate", "slope"):
            found = np.shape(getattr(gains, name))
            if found != (n,):
                raise InputError(f"gains.{name} has shape {found}; robot '{robot.name}' has {n} joints")
        return gains


@register_dataclass
@dataclass(frozen=True)
class Errors:
    """position q, velocity qd, e = q_d - q, e_dot and r = e_dot + Lambda e, all (n,)."""

    position: Array
    velocity: Array
    error: Array
    error_rate: Array
    combined: Array


def tracking_errors(measured: Measured, desired: Desired, slope: Vector) -> Errors:
    """The errors at a sample; where the measurement was lost the joints count as where they should be, so that an old
    error does not push a motion that no one sees."""
    fresh = measured.fresh
    position = jnp.where(fresh, measured.joint_position, desired.joint_position)
    velocity = jnp.where(fresh, measured.joint_velocity, desired.joint_velocity)
    error, error_rate = desired.joint_position - position, desired.joint_velocity - velocity
    return Errors(position, velocity, error, error_rate, error_rate + slope * error)


def decoupled_inertia(robot: Robot, joint_position: Vector) -> Vector:
    """M_ii (n,): torque per acceleration of each joint of the free-floating robot while the others are left to move,
    1/(H*^-1)_ii, kg m^2 or kg.

    It is what "the equivalent moment of inertia of a joint" of equation (4) means where joints are coupled. The
    diagonal of H*, the inertia with the others held, is up to nine times larger (published arm, stretched), and with it
    the published gains are unstable at 100 Hz.
    """
    position = jnp.asarray(joint_position, dtype=float)
    state = State(jnp.zeros(3), jnp.array([1.0, 0.0, 0.0, 0.0]), position)
    inertia = generalized_inertia(robot, kinematics(robot, state))
    return 1.0 / jnp.diagonal(jnp.linalg.inv(inertia))
