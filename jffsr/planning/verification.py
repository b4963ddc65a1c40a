"""The re-run of a finished plan by independent code at a finer step, and what it is measured against."""

from __future__ import annotations

from dataclasses import dataclass, field

import jax.numpy as jnp

from jffsr.objectives.composite import CompositeIndex, TermValue
from jffsr.objectives.constraints import largest_violation
from jffsr.objectives.terms import AttitudeExcursion, attitude_angles
from jffsr.objectives.torque_terms import JointTorque
from jffsr.planning.problem import Problem
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.rollouts.conservation import momentum_drift
from jffsr.rollouts.joint_torque import with_joint_torque
from jffsr.rollouts.kernels import PLAIN
from jffsr.rollouts.motion import Motion
from jffsr.rollouts.reference import reference_rollout
from jffsr.spatial.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_rotation_vector,
)
from jffsr.trajectories.interface import PlannedTrajectory
from jffsr.types import Array, Scalar, Vector


@register_dataclass
@dataclass(frozen=True)
class Overruns:
    """Relative overruns of the limits on the finer grid; negative inside, -1 or -inf where nothing moves.

    position, rate and acceleration (n,), a position's relative to half its range; excursion (3,), one an axis
    of the base (-inf without a limit); torque (n,), -inf where no term of the index limits it.
    """

    position: Array
    rate: Array
    acceleration: Array
    excursion: Array
    torque: Array


@register_dataclass
@dataclass(frozen=True)
class Verification:
    """What the finer re-run by the reference path says of a plan.

    attitude_difference, rad, and position_difference, m: largest between the two runs at common times;
    boundary_error: largest miss of the joint positions, rates and accelerations asked for at both ends;
    momentum_drift: relative, from differenced poses; cost and terms: the published index of the finer run;
    measure: that over the uncertain robots at the planner's step, the same as cost where nothing is uncertain;
    violations: of each constraint by name, the largest in the finer run, zero where it is kept.
    """

    attitude_difference: Scalar
    position_difference: Scalar
    boundary_error: Scalar
    momentum_drift: Scalar
    cost: Scalar
    measure: Scalar
    terms: dict[str, TermValue]
    overruns: Overruns
    violations: dict[str, Scalar] = field(default_factory=dict)


def verify(problem: Problem, candidate: Vector, step_factor: int = 4) -> tuple[Motion, Verification]:
    """The motion of the free numbers (k,) and its verification at step_factor (static) times the steps."""
    motion = problem.motion(candidate)
    trajectory = problem.trajectory.with_free(candidate)
    finer = reference_rollout(
        problem.robot,
        trajectory,
        problem.initial_state,
        num_steps=step_factor * problem.num_steps,
        momentum=problem.momentum,
        base_mode=problem.base_mode,
    )
    if problem.needs_torque:
        finer = with_joint_torque(problem.robot, finer, PLAIN)
    common = finer.base_quaternion[::step_factor]
    error = quaternion_multiply(quaternion_conjugate(common), motion.base_quaternion)
    angle = jnp.linalg.norm(quaternion_to_rotation_vector(error), axis=-1)
    distance = jnp.linalg.norm(finer.base_position[::step_factor] - motion.base_position, axis=-1)
    terms = problem.objective.breakdown(problem.robot, finer)
    cost = problem.objective.value(problem.robot, finer)
    return motion, Verification(
        attitude_difference=jnp.max(angle),
        position_difference=jnp.max(distance),
        boundary_error=_boundary_error(trajectory),
        momentum_drift=momentum_drift(problem.robot, finer),
        cost=cost,
        measure=cost if problem.uncertainty is None else problem.value(candidate),
        terms=terms,
        overruns=_overruns(problem.robot, problem.objective, finer),
        violations={c.name: largest_violation(c, problem.robot, finer) for c in problem.constraints},
    )


def _boundary_error(trajectory: PlannedTrajectory) -> Scalar:
    """Largest miss at both ends of what the trajectory was asked for there."""
    duration = jnp.asarray(trajectory.duration)
    misses = [
        found - asked
        for time, end in zip((jnp.zeros_like(duration), duration), trajectory.boundary(), strict=True)
        for found, asked in zip(trajectory(time), end, strict=True)
        if asked is not None
    ]
    return jnp.max(jnp.abs(jnp.concatenate(misses)))


def _overruns(robot: Robot, objective: CompositeIndex, motion: Motion) -> Overruns:
    grid, limits = motion.joint_grid, robot.limits
    lower, upper = jnp.asarray(limits.position_lower), jnp.asarray(limits.position_upper)
    half = jnp.where(jnp.isfinite(upper - lower), (upper - lower) / 2, 1.0)
    beyond = jnp.maximum(grid.joint_position - upper, lower - grid.joint_position)
    excursion, torque = jnp.full(3, -jnp.inf), jnp.full(robot.num_joints, -jnp.inf)
    for term in objective.terms:
        if isinstance(term, AttitudeExcursion):
            angles = attitude_angles(motion, term.measure)
            excursion = jnp.max(jnp.abs(angles), axis=0) / term.limit - 1
        if isinstance(term, JointTorque):
            torque = jnp.max(jnp.abs(motion.joint_torque), axis=0) / term.limit - 1
    return Overruns(
        position=jnp.max(beyond, axis=0) / half,
        rate=jnp.max(jnp.abs(grid.joint_velocity), axis=0) / limits.velocity - 1,
        acceleration=jnp.max(jnp.abs(grid.joint_acceleration), axis=0) / limits.acceleration - 1,
        excursion=excursion,
        torque=torque,
    )
