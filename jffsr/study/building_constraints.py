"""From the section `constraints` to the constraints of a problem."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from jffsr.clearance.model import ClearanceModel
from jffsr.clearance.reports import nearest_approach
from jffsr.errors import InputError
from jffsr.objectives.clearance import MISS, Clearance
from jffsr.objectives.constraints import BaseExcursion, Constraint, FinalAttitude, joint_limits
from jffsr.objectives.torque_terms import TorqueLimit
from jffsr.robots.robot import Robot
from jffsr.study.schema import PlanningConfig


def build_constraints(config: PlanningConfig, robot: Robot) -> tuple[Constraint, ...]:
    """The constraints that are given, in the order of the section."""
    wanted, found = config.constraints, []
    if wanted.final_attitude is not None:
        goal, tolerance = wanted.final_attitude.quaternion, wanted.final_attitude.tolerance
        found.append(FinalAttitude(np.array(goal), np.asarray(tolerance)))
    if wanted.joint_limits is not None:
        limits = joint_limits(robot, wanted.joint_limits.quantities)
        found.append(replace(limits, tolerance=np.asarray(wanted.joint_limits.tolerance)))
    if wanted.base_excursion is not None:
        limit, tolerance = config.limits.base_excursion_si, wanted.base_excursion.tolerance
        measure = config.objective.attitude_measure
        found.append(BaseExcursion(np.array(limit), tolerance=np.asarray(tolerance), measure=measure))
    if wanted.torque_limit is not None:
        limit = robot.limits.torque
        if not np.any(np.isfinite(limit)):
            raise InputError(
                f"{config.where('constraints.torque_limit')}: given, but robot '{robot.name}' has no torque limits; "
                f"give limits.torque"
            )
        found.append(TorqueLimit(limit, tolerance=np.asarray(wanted.torque_limit.tolerance)))
    if wanted.clearance is not None:
        found.append(_clearance(config, robot))
    return tuple(found)


class _Still(NamedTuple):
    base_position: np.ndarray
    base_quaternion: np.ndarray
    joint_position: np.ndarray
    time: np.ndarray = np.zeros(1)


def _clearance(config: PlanningConfig, robot: Robot) -> Clearance:
    try:
        model = ClearanceModel.create(robot)
    except InputError as error:
        raise InputError(f"{config.where('constraints.clearance')}: {error}") from error
    wanted = config.constraints.clearance
    for end in ("start", "goal"):
        _check_end(config, robot, model, end)
    return Clearance(model, np.asarray(wanted.margin), tolerance=np.asarray(wanted.tolerance / MISS))


def _check_end(config: PlanningConfig, robot: Robot, model: ClearanceModel, end: str) -> None:
    """InputError where two bodies are nearer than the margin at the start or goal, which every motion goes through."""
    wanted, task = config.constraints.clearance, config.task
    pose = _Still(*(np.array([x]) for x in (task.base_position, task.base_quaternion, task.si(end))))
    near = nearest_approach(model, robot, pose)
    if near.distance < wanted.margin - wanted.tolerance:
        first, second = near.pair
        how = (
            f"overlap by {-near.distance:.4g} m" if near.distance < 0 else f"are {near.distance:.4g} m apart"
        )
        where, key = config.where(f"task.{task.key_of(end)}"), "constraints.clearance.margin"
        raise InputError(
            f"{where}: {first} and {second} {how} at the {end}; at least '{key}' is expected, {wanted.margin:g} m"
        )
