"""The tracking itself: one scan over the times at which rates are found, the base integrated while they are held."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.dynamics.base_mode import FLOATING, base_freedom
from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.motion import JointGrid, Motion
from jffsr.rollouts.rollout import check_steps, rollout_grid
from jffsr.tracking.damping import raised_cosine
from jffsr.tracking.free_base import response
from jffsr.tracking.inverses import (
    TRANSPOSE,
    damping_for,
    null_space,
    rates_and_values,
    singular_values,
)
from jffsr.tracking.limits import IGNORE, REDISTRIBUTE, Bounded, rate_bounds, redistributed, scaled
from jffsr.tracking.redundancy import Situation
from jffsr.tracking.tool_task import mean_twist, pose_error, tracked_error, tracked_rows
from jffsr.tracking.tracked import Tracked
from jffsr.tracking.tracker import MEAN, Tracker, check_gains, check_start, check_tracker
from jffsr.trajectories.cartesian.interface import ToolTarget
from jffsr.types import Array, Quaternion, Scalar, Twist, Vector, Vector3

Target = Callable[[Scalar], ToolTarget]
"""What the tool should do at a time, s."""


class _Moving(NamedTuple):
    """What one step hands to the next."""

    base_position: Array
    base_quaternion: Array
    joint_position: Array
    joint_rate: Array


def track(
    robot: Robot,
    target: Target,
    initial_state: State,
    tracker: Tracker,
    duration: Scalar | float | None = None,
    momentum: Twist | None = None,
    end_effector: str | None = None,
    base_mode: str = FLOATING,
    num_samples: int | None = None,
) -> Tracked:
    """Motion of a robot whose tool follows a target, by joint rates from the generalized Jacobian.

    target: any callable of a time, s, that gives a `ToolTarget`. The rates answer its twist, less what the momentum
    (6,), P and L about the system centre of mass, moves the tool by itself (v = J* qd + H* G), plus the fed back
    pose error. They are held over period/substeps while the base follows from conservation of momentum. duration,
    s, defaults to the target's; it is cut into num_samples (static) samples, by default as many periods. Joint rates
    before the start are initial_state.joint_velocity, else zero, which the acceleration limit counts from. Everything
    but sizes and names is traced; put it under `jffsr.compiling.jit`. Raises InputError for what `check_tracker`
    refuses, a start outside the joint limits that act, an unknown end effector or base_mode, and a duration that is no
    whole number of periods.
    """
    check_tracker(tracker)
    if tracker.limits != IGNORE:
        check_start(robot, initial_state)
    base_freedom(base_mode)
    robot.end_effector_index(end_effector)
    duration = getattr(target, "duration", None) if duration is None else duration
    if duration is None:
        raise InputError("the target has no duration of its own: pass duration=, in seconds")
    count = samples(duration, tracker.period) if num_samples is None else check_steps(num_samples)
    steps = count * tracker.substeps
    step = duration / steps
    if not isinstance(step, jax.core.Tracer):
        check_gains(tracker, float(np.max(step)))
    momentum = jnp.zeros(6) if momentum is None else jnp.asarray(momentum)
    start = State(*(jnp.asarray(x, dtype=float) for x in _pose(initial_state)))
    return _tracked(
        robot, target, start, initial_state, tracker, step, steps, momentum, end_effector, base_mode
    )


def track_rates(
    robot: Robot,
    target: Target,
    initial_state: State,
    rates: Array,
    duration: Scalar | float,
    momentum: Twist | None = None,
    end_effector: str | None = None,
    base_mode: str = FLOATING,
    integration_steps: int = 4,
) -> Tracked:
    """What `track` reports, of joint rates (K, n) that are given: each is held for a share 1/K of the duration, s.

    limited is false and share one. Raises InputError for rates of another robot and for what `track` refuses.
    """
    base_freedom(base_mode)
    robot.end_effector_index(end_effector)
    rates = jnp.asarray(rates)
    if rates.ndim != 2 or rates.shape[0] < 1 or rates.shape[1] != robot.num_joints:
        raise InputError(
            f"rates have the shape {rates.shape}; (K, {robot.num_joints}), a row for each time they are held, is "
            "expected"
        )
    tracker = Tracker(integration_steps=check_steps(integration_steps))
    momentum = jnp.zeros(6) if momentum is None else jnp.asarray(momentum)
    start = State(*(jnp.asarray(x, dtype=float) for x in _pose(initial_state)))
    steps = rates.shape[0]
    return _tracked(
        robot,
        target,
        start,
        initial_state,
        tracker,
        duration / steps,
        steps,
        momentum,
        end_effector,
        base_mode,
        jnp.concatenate([rates, rates[-1:]]),
    )


def _pose(state: State) -> tuple:
    return state.base_position, state.base_quaternion, state.joint_position


def samples(duration: Scalar | float, period: float) -> int:
    """How many periods a duration has, both in s; InputError where it is traced or no whole number of them."""
    if isinstance(duration, jax.core.Tracer):
        raise InputError("the duration is traced: pass num_samples=, how many samples it is cut into")
    share = float(duration) / period
    count = round(share) if np.isfinite(share) else 0
    if count < 1 or abs(share - count) > 1e-6 * count:
        raise InputError(
            f"the duration is {float(duration):g} s; a whole number of periods of {period:g} s is expected"
        )
    return count


class _Seen(NamedTuple):
    """What one step reports of its start."""

    moving: _Moving
    base_twist: Array
    arrival_twist: Array
    target: ToolTarget
    tool_position: Vector3
    tool_quaternion: Quaternion
    singular_values: Vector
    determinant: Array | None
    commanded: Vector
    held: Vector
    limited: Array
    share: Scalar


def _tracked(
    robot, target, start, initial, tracker, step, steps, momentum, end_effector, base_mode, given=None
) -> Tracked:
    """The motion, by the tracker's rates or by those given (steps + 1, n), the last of which is only reported."""

    def advance(moving: _Moving, row: tuple[Scalar, Vector | None]) -> tuple[_Moving, _Seen]:
        time, rates = row
        state = State(moving.base_position, moving.base_quaternion, moving.joint_position)
        kin = kinematics(robot, state)
        answer = response(robot, kin, momentum, end_effector, base_mode)
        situation = Situation(robot, state, kin, answer, start, momentum, end_effector, base_mode)
        seen = _rates(situation, target, tracker, time, step, moving, rates)
        inner = rollout_grid(
            robot, _held_grid(moving.joint_position, seen.held, step, tracker), state, momentum, base_mode
        )
        following = _Moving(
            inner.base_position[-1],
            inner.base_quaternion[-1],
            moving.joint_position + step * seen.held,
            seen.held,
        )
        return following, seen

    rate = (
        jnp.zeros(robot.num_joints) if initial.joint_velocity is None else jnp.asarray(initial.joint_velocity)
    )
    first = _Moving(start.base_position, start.base_quaternion, start.joint_position, rate)
    time = jnp.arange(steps + 1) * step
    # One step more than the motion has: it reports where the last one led.
    _, seen = jax.lax.scan(advance, first, (time, given))
    error = jax.vmap(pose_error)(
        seen.tool_position, seen.tool_quaternion, seen.target.position, seen.target.quaternion
    )
    return Tracked(
        motion=_motion(seen, rate, time, step, momentum, base_mode),
        target_position=seen.target.position,
        target_quaternion=seen.target.quaternion,
        target_twist=seen.target.twist,
        tool_position=seen.tool_position,
        tool_quaternion=seen.tool_quaternion,
        pose_error=error,
        singular_values=seen.singular_values,
        manipulability=jnp.prod(seen.singular_values, axis=-1),
        determinant=seen.determinant,
        commanded_rate=seen.commanded,
        limited=seen.limited,
        share=seen.share,
    )


def _rates(
    s: Situation,
    target: Target,
    tracker: Tracker,
    time: Scalar,
    step: Scalar,
    moving: _Moving,
    given: Vector | None,
) -> _Seen:
    """The rates to hold from this time on, the tracker's or those given, and all that is reported of it."""
    robot, kin = s.robot, s.kin
    position, quaternion = end_effector_pose(robot, kin, s.end_effector)
    jacobian = tracked_rows(tracker.freedom, quaternion, s.response.jacobian)
    now = target(time)
    if given is None:
        later = target(time + step) if tracker.feedforward == MEAN else None
        pose = position, quaternion
        rates, rest, bounded, sigma = _wanted_rates(s, tracker, jacobian, pose, now, later, moving, step)
    else:
        rates, rest, bounded = given, jnp.zeros_like(given), Bounded(given, jnp.ones(()))
        sigma = singular_values(jacobian)
    return _Seen(
        moving=moving,
        base_twist=s.response.base_twist(bounded.rates),
        arrival_twist=s.response.base_twist(moving.joint_rate),
        target=now,
        tool_position=position,
        tool_quaternion=quaternion,
        singular_values=sigma,
        determinant=jnp.linalg.det(s.response.jacobian) if robot.num_joints == 6 else None,
        commanded=rates + rest,
        held=bounded.rates,
        limited=jnp.any(bounded.rates != rates + rest),
        share=bounded.share,
    )


def _wanted_rates(
    s: Situation,
    tracker: Tracker,
    jacobian: Array,
    pose: tuple[Vector3, Quaternion],
    now: ToolTarget,
    later: ToolTarget | None,
    moving: _Moving,
    step: Scalar,
) -> tuple[Vector, Vector, Bounded, Vector]:
    """What `_resolved` gives for the target's twist and the tool's error that is fed back."""
    velocity = now.twist if later is None else mean_twist(now, later, step)
    gains = jnp.repeat(jnp.stack([jnp.asarray(tracker.position_gain), jnp.asarray(tracker.attitude_gain)]), 3)
    off = tracked_error(tracker.freedom, *pose, now.position, now.quaternion)
    wanted = tracked_rows(tracker.freedom, pose[1], velocity - gains * off)
    drift = tracked_rows(tracker.freedom, pose[1], s.response.drift)
    return _resolved(s, tracker, jacobian, wanted, drift, moving, step)


def _resolved(
    s: Situation,
    tracker: Tracker,
    jacobian: Array,
    wanted: Vector,
    drift: Vector,
    moving: _Moving,
    step: Scalar,
) -> tuple[Vector, Vector, Bounded, Vector]:
    """Rates (n,) of the task, the rates beside it, what the limits make of both, and the singular values."""
    damping = damping_for(
        tracker.method, jacobian, tracker.lambda_max, tracker.epsilon, tracker.damping, tracker.threshold
    )
    both = jnp.stack([wanted, -drift], axis=1)
    found, sigma = rates_and_values(tracker.method, jacobian, both, damping)
    task, make_up = found[:, 0], found[:, 1]
    beside = jnp.zeros(s.robot.num_joints)
    if tracker.secondary:
        # The projector has the adaptive damping whatever the method: exact away from singularities, smooth in them.
        cosine = raised_cosine(tracker.lambda_max, tracker.epsilon)
        space, total = null_space(jacobian, cosine), task + make_up
        for secondary in tracker.secondary:
            total, space = secondary(s, total, space, cosine)
        beside = total - task - make_up
    rest = make_up + beside
    if tracker.limits == IGNORE:
        return task, rest, Bounded(task + rest, jnp.ones(())), sigma
    lower, upper = rate_bounds(s.robot.limits, s.state.joint_position, moving.joint_rate, step)
    if tracker.limits == REDISTRIBUTE and tracker.method != TRANSPOSE:
        bounded = redistributed(jacobian, wanted, drift, beside, lower, upper, damping)
    else:
        bounded = scaled(task, rest, lower, upper)
    inside = jnp.all((task + rest >= lower) & (task + rest <= upper))
    # Where nothing is limited the rates are those asked for, to the bit.
    rates = jnp.where(inside, task + rest, bounded.rates)
    return task, rest, Bounded(rates, jnp.where(inside, 1.0, bounded.share)), sigma


def _held_grid(position: Vector, rate: Vector, step: Scalar, tracker: Tracker) -> JointGrid:
    """The joints on the grid of the Runge-Kutta steps over which the rates are held."""
    points = 2 * tracker.integration_steps + 1
    time = jnp.linspace(0.0, 1.0, points) * step
    rates = jnp.broadcast_to(rate, (points, *rate.shape))
    return JointGrid(time, position + time[:, None] * rate, rates, jnp.zeros_like(rates))


def _motion(seen: _Seen, rate: Vector, time: Array, step: Scalar, momentum: Twist, base_mode: str) -> Motion:
    """The sampled motion and its joints at the samples and halfway between."""
    position, held = seen.moving.joint_position, seen.held[:-1]
    velocity = jnp.concatenate([held, held[-1:]])
    change = jnp.diff(jnp.concatenate([rate[None], velocity]), axis=0) / step
    twice = 2 * len(held) + 1

    def doubled(rows: Array) -> Array:
        return jnp.repeat(rows, 2, axis=0)[:twice]

    middle = position[:-1] + 0.5 * step * held
    between = jnp.stack([position[:-1], middle], axis=1).reshape(twice - 1, -1)
    grid = JointGrid(
        jnp.arange(twice) * (0.5 * step),
        jnp.concatenate([between, position[-1:]]),
        doubled(velocity),
        doubled(change),
    )
    return Motion(
        time=time,
        base_position=seen.moving.base_position,
        base_quaternion=seen.moving.base_quaternion,
        base_twist=jnp.concatenate([seen.base_twist[:-1], seen.arrival_twist[-1:]]),
        joint_position=position,
        joint_velocity=velocity,
        joint_acceleration=change,
        momentum=momentum,
        joint_grid=grid,
        base_mode=base_mode,
    )
