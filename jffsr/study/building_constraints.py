"""From the section `constraints` to the constraints of a problem."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jffsr.objectives.constraints import BaseExcursion, Constraint, FinalAttitude, joint_limits
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
    return tuple(found)
