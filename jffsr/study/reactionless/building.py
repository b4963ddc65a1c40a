"""From a reactionless study's configuration to the robot, its load, and both as one after the grasp."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import jax
import numpy as np

from jffsr.capture.contact_compound import Compound, grasped
from jffsr.compiling import program
from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.dynamics.momentum import base_twist
from jffsr.errors import InputError
from jffsr.reactionless.estimation.balance import Load
from jffsr.reactionless.estimation.models import KnownLoad
from jffsr.reactionless.plant_settings import Strike
from jffsr.reactionless.plant_strike import Pendulum
from jffsr.robots.robot import Robot
from jffsr.spatial.rotation import (
    quaternion_multiply,
    quaternion_to_matrix,
    rotation_vector_to_quaternion,
)
from jffsr.study.building import build_robot
from jffsr.study.reactionless.holding import build_controller
from jffsr.study.reactionless.schema import ReactionlessConfig
from jffsr.study.start import chosen_end_effector, start_state
from jffsr.target.body import Target
from jffsr.target.target_state import TargetState

_T = TypeVar("_T")


@dataclass(frozen=True)
class ReactionlessStudy:
    """A robot and what it has just grasped: robot alone, compound, the load as it is, and what strikes the tool."""

    robot: Robot
    end_effector: str
    compound: Compound
    known: KnownLoad
    strike: Strike | None


def build_study(config: ReactionlessConfig) -> ReactionlessStudy:
    """The study; InputError with file, line and key where robot, load and settings do not fit."""
    robot = build_robot(config)
    start = start_state(config, robot)
    end_effector = chosen_end_effector(config, robot, "grasp a load")
    for name, hold in config.holds.items():
        build_controller(hold, robot, start, f"{config.where('hold')}: run '{name}'", end_effector)
    if config.strike is not None and end_effector != robot.end_effector_names[0]:
        raise InputError(
            f"{config.where('strike')}: the pendulum strikes the first end effector, '{robot.end_effector_names[0]}'; "
            f"the load is on '{end_effector}'"
        )
    wanted = config.load
    target = _told(config, "load.inertia", lambda: Target.create(np.array(wanted.inertia), wanted.mass))
    attitude = _attitude(config)
    place, quaternion = jax.device_get(end_effector_pose(robot, kinematics(robot, start), end_effector))
    turn = np.asarray(quaternion_to_matrix(quaternion))
    full = np.asarray(quaternion_multiply(quaternion, attitude))
    back = np.asarray(quaternion_to_matrix(full)).T
    state = TargetState.create(
        place + turn @ np.array(wanted.position),
        np.array(wanted.velocity),
        full,
        back @ np.array(wanted.si("angular_velocity")),
    )
    momentum = np.array(config.task.momentum)
    moving = _moving(robot, start, momentum)
    compound = jax.device_get(_compound(robot, moving, target, state, end_effector))
    own = np.asarray(quaternion_to_matrix(attitude))
    load = Load(
        np.asarray(wanted.mass, float), np.array(wanted.position), own @ np.asarray(target.inertia) @ own.T
    )
    return ReactionlessStudy(
        robot,
        end_effector,
        compound,
        KnownLoad(load, np.asarray(compound.momentum[3:])),
        build_strike(config),
    )


def build_strike(config: ReactionlessConfig) -> Strike | None:
    """The pendulum's blow, or None."""
    wanted = config.strike
    if wanted is None:
        return None
    pendulum = Pendulum(
        wanted.mass,
        wanted.rope,
        wanted.si("release"),
        wanted.si("rebound"),
        wanted.contact,
        wanted.si("incidence"),
        wanted.arm,
    )
    return pendulum.strike(wanted.time, wanted.with_force)


@program(static_argnums=4, once=True)
def _compound(robot, state, target, target_state, end_effector):
    return grasped(robot, state, target, target_state, end_effector)


def _moving(robot, start, momentum):
    """The start with the base moving as the momentum before the grasp says, the joints at rest."""
    rest = np.zeros(robot.num_joints)
    twist = np.zeros(6) if not np.any(momentum) else np.asarray(_twist(robot, start, rest, momentum))
    return replace(start, base_twist=twist, joint_velocity=rest)


@program(once=True)
def _twist(robot, start, rest, momentum):
    return base_twist(robot, kinematics(robot, start), rest, momentum)


def _attitude(config: ReactionlessConfig) -> np.ndarray:
    """Quaternion (4,), the load's frame to the tool's; InputError where it is none."""
    wanted = config.load
    if wanted.quaternion is None:
        vector = wanted.si("rotation_vector")
        return np.asarray(rotation_vector_to_quaternion(np.zeros(3) if vector is None else np.array(vector)))
    quaternion = np.array(wanted.quaternion)
    length = np.linalg.norm(quaternion)
    if not abs(length - 1) < 1e-3:
        raise InputError(
            f"{config.where('load.quaternion')}: found {list(wanted.quaternion)} of length {length:.4g}, a unit "
            "quaternion is expected"
        )
    return quaternion / length


def _told(config: ReactionlessConfig, key: str, build: Callable[[], _T]) -> _T:
    """What build makes; its complaint with the place of the key."""
    try:
        return build()
    except InputError as error:
        raise InputError(f"{config.where(key)}: {error}") from None
