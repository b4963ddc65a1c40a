"""From the section `constraints` to the constraints of a problem."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jffsr.clearance.model import ClearanceModel
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


def _clearance(config: PlanningConfig, robot: Robot) -> Clearance:
    try:
        model = ClearanceModel.create(robot)
    except InputError as error:
        raise InputError(f"{config.where('constraints.clearance')}: {error}") from error
    wanted = config.constraints.clearance
    return Clearance(model, np.asarray(wanted.margin), tolerance=np.asarray(wanted.tolerance / MISS))
