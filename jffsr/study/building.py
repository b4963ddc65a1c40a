"""From a typed configuration to a problem and the optimizer's settings: the checks that need the robot."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import jax
import numpy as np

from jffsr.errors import InputError
from jffsr.objectives.composite import CompositeIndex, composite_index
from jffsr.objectives.smoothing import Smoothing
from jffsr.objectives.terms import JointPosition, Term, UserTerm
from jffsr.objectives.torque_terms import (
    AttitudePenalty,
    JointTorque,
    MechanicalWork,
    PeakTorque,
    TorqueEnergy,
    TorqueIntegral,
)
from jffsr.optimizers.registry import Settings
from jffsr.planning.problem import Problem
from jffsr.planning.result import Tolerances
from jffsr.planning.uncertainty import Uncertainty
from jffsr.robots.loading import load_robot
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.study.building_constraints import build_constraints
from jffsr.study.calls import called_function
from jffsr.study.degrees import refuse_degrees
from jffsr.study.joint_laws import build_trajectory
from jffsr.study.robot_study import RobotStudy
from jffsr.study.schema import PlanningConfig


def build_problem(config: PlanningConfig) -> Problem:
    """The planning problem; InputError with file, line and key where the robot and the task do not fit."""
    robot = build_robot(config)
    trajectory = build_trajectory(config, robot)
    task = config.task
    problem = Problem(
        robot=robot,
        trajectory=trajectory,
        objective=_objective(config, robot),
        initial_state=State(
            np.array(task.base_position), np.array(task.base_quaternion), np.array(task.start_si)
        ),
        momentum=np.array(task.momentum),
        num_steps=config.rollout.num_steps,
        base_mode=config.rollout.base_mode,
        kernel=config.rollout.kernel,
        uncertainty=_uncertainty(config, robot),
        constraints=build_constraints(config, robot),
    )
    _check_user_terms(config, problem)
    return problem


def build_robot(config: RobotStudy) -> Robot:
    """The robot with the limits that the study puts in place of its own."""
    try:
        robot = load_robot(config.robot)
    except InputError as error:
        raise InputError(f"{config.where('robot')}: {error}") from None
    for quantity in ("position", "rate", "acceleration"):
        refuse_degrees(config, "limits", quantity, robot)
    limits, names = robot.limits, robot.joint_names
    own = list(zip(limits.position_lower, limits.position_upper, strict=True))
    position = config.per_joint("position", names, own)
    rate = config.per_joint("rate", names, limits.velocity)
    acceleration = config.per_joint("acceleration", names, limits.acceleration)
    torque = config.per_joint("torque", names, limits.torque)
    changes = {}
    if position is not None:
        changes["position_lower"] = np.array([low for low, _ in position])
        changes["position_upper"] = np.array([high for _, high in position])
    if rate is not None:
        changes["velocity"] = np.array(rate)
    if acceleration is not None:
        changes["acceleration"] = np.array(acceleration)
    if torque is not None:
        changes["torque"] = np.array(torque)
    return robot.replace(limits=replace(limits, **changes))


def build_settings(config: PlanningConfig) -> tuple[str, Settings]:
    """The registered optimizer's name and its settings."""
    return config.optimizer.kind, config.optimizer.settings()


def build_tolerances(config: PlanningConfig) -> Tolerances:
    """What the verification must keep."""
    wanted = config.verification
    return Tolerances(
        limit=wanted.limit_tolerance,
        attitude=wanted.attitude_tolerance,
        momentum=wanted.momentum_tolerance,
    )


def _uncertainty(config: PlanningConfig, robot: Robot) -> Uncertainty | None:
    wanted = config.robust
    if wanted.samples == 0:
        return None
    return Uncertainty.sampled(
        robot,
        wanted.samples,
        wanted.measure,
        level=wanted.level,
        seed=wanted.seed,
        width=wanted.width,
        **wanted.deviations,
    )


def _objective(config: PlanningConfig, robot: Robot) -> CompositeIndex:
    objective, task = config.objective, config.task

    def scale(name: str, value: float) -> float | None:
        return value if config.term_enabled(name) else None

    if task.end_effector is not None and task.end_effector not in robot.end_effector_names:
        raise InputError(
            f"{config.where('task.end_effector')}: found '{task.end_effector}', robot '{robot.name}' has "
            f"{', '.join(robot.end_effector_names) or 'none'}"
        )
    if config.term_enabled("tool_position") and not robot.end_effector_names:
        raise InputError(
            f"{config.where('objective.tool_position.enabled')}: found true, robot '{robot.name}' has no end effector"
        )
    smoothing = objective.smoothing
    return composite_index(
        robot,
        joint_goal=task.goal_si,
        initial_quaternion=task.base_quaternion,
        goal_quaternion=task.goal_attitude,
        excursion_limit=config.limits.base_excursion_si,
        attitude_change=scale("attitude_change", objective.attitude_change.scale_si),
        joint_rate=scale("joint_rate", objective.joint_rate.scale),
        joint_acceleration=scale("joint_acceleration", objective.joint_acceleration.scale),
        attitude_excursion=scale("attitude_excursion", objective.attitude_excursion.scale),
        goal_attitude=scale("goal_attitude", objective.goal_attitude.scale),
        tool_position=scale("tool_position", objective.tool_position.scale),
        measure=objective.attitude_measure,
        end_effector=task.end_effector,
        smoothing=Smoothing(smoothing.norm, smoothing.peak, smoothing.overrun),
        accuracy=objective.accuracy,
        extra=[
            *_further_terms(config, robot),
            *(_user_term(config, i) for i in range(len(objective.terms))),
        ],
    )


def _further_terms(config: PlanningConfig, robot: Robot) -> Iterator[Term]:
    """The terms of joint torques, and those that only some joint laws need."""
    objective, task, limits = config.objective, config.task, robot.limits
    desired = task.base_quaternion if task.goal_attitude is None else task.goal_attitude
    made = {
        "joint_position": lambda scale: JointPosition(scale, limits.position_lower, limits.position_upper),
        "joint_torque": lambda scale: JointTorque(scale, limits.torque),
        "torque_integral": TorqueIntegral,
        "torque_energy": TorqueEnergy,
        "mechanical_work": MechanicalWork,
        "peak_torque": PeakTorque,
        "attitude_penalty": lambda scale: AttitudePenalty(scale, np.array(desired)),
    }
    for name, make in made.items():
        if config.term_enabled(name):
            yield make(np.asarray(getattr(objective, name).scale))


def _user_term(config: PlanningConfig, index: int) -> UserTerm:
    term = config.objective.terms[index]
    where = config.where(f"objective.terms.{index}.call")
    function = called_function(term.call, where, "(robot, motion)")
    with np.errstate(divide="ignore"):
        scale = np.float64(1.0) / np.float64(term.weight)
    return UserTerm(scale, function, term.label)


def _check_user_terms(config: PlanningConfig, problem: Problem) -> None:
    """Trace each of the user's terms once, so that its mistake is told at its line and not as a traceback."""
    own = [term for term in problem.objective.terms if isinstance(term, UserTerm)]
    if not own:
        return
    lower, _ = problem.bounds()
    motion = jax.eval_shape(problem.motion, np.zeros(lower.shape))
    for index, term in enumerate(own):
        where = config.where(f"objective.terms.{index}.call")
        try:
            shape = jax.eval_shape(term.value, problem.robot, motion).shape
        except Exception as error:
            told = f"{type(error).__name__}: {error}".splitlines()[0]
            raise InputError(f"{where}: '{term.name}' failed on (robot, motion) ({told[:200]})") from None
        if shape != ():
            raise InputError(f"{where}: '{term.name}' gives an array of shape {shape}; a scalar is expected")
