"""The programs of the tracking benchmark: jffsr's own, alone and in a batch."""

from __future__ import annotations

import time

import jax
import jax.numpy as jnp
import numpy as np

import jffsr
from experiments.benchmarks.opponents.program import Program, called
from experiments.benchmarks.tracking_case import (
    DURATION,
    EPSILON,
    INNER,
    LARGEST,
    PERIOD,
    START,
    TrackingCase,
)
from jffsr.compiling import jit
from jffsr.dynamics.base_mode import FLOATING
from jffsr.rollouts.rollout import rollout_grid
from jffsr.spatial.rotation import quaternion_multiply, rotation_vector_to_quaternion
from jffsr.tracking.damping import raised_cosine
from jffsr.tracking.free_base import response
from jffsr.tracking.inverses import ADAPTIVE, inverse_and_values, rates_and_values
from jffsr.tracking.tracking import _held_grid

ALONE = 16
"""Trackers, or states, that are done one after another; the time of each is the same."""


def _over_batch(one, batch) -> Program:
    """The results of all candidates in one call, over all devices."""
    return called(lambda candidates: jffsr.map_batch(one, candidates), batch)


def trackers(case: TrackingCase) -> Program:
    """Tool position at the end and largest joint rate (K, 4) of all trackers in one call."""
    return _over_batch(_tracker(case), case.numbers)


def trackers_alone(case: TrackingCase) -> Program:
    """The same of the first few, one call after another."""
    return _one_by_one(
        _tracker(case), [jax.tree.map(lambda x, k=k: x[k], case.numbers) for k in range(ALONE)]
    )


def _one_by_one(one, candidates: list) -> Program:
    """The results of a few candidates, each by a call of a program for one."""
    started = time.perf_counter()
    program = jit(one).lower(candidates[0]).compile()
    seconds = time.perf_counter() - started
    return Program(
        lambda: np.array([jax.block_until_ready(program(x)) for x in candidates]), seconds, len(candidates)
    )


def _tracker(case: TrackingCase):
    robot = case.robot
    state = jffsr.State(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), START)
    start = jffsr.end_effector_pose(robot, jffsr.kinematics(robot, state))
    turn = jnp.array([0.0, 0.12, -0.1])

    def one(numbers):
        goal = numbers["goal"], quaternion_multiply(rotation_vector_to_quaternion(turn), start[1])
        timing = jffsr.Trapezoid(jnp.asarray(DURATION), jnp.asarray(0.2))
        target = jffsr.ToolTrajectory(jffsr.Line(*start, *goal), timing)
        tracker = jffsr.Tracker(
            lambda_max=numbers["lambda_max"],
            epsilon=numbers["epsilon"],
            position_gain=numbers["gain"],
            attitude_gain=numbers["gain"],
            period=PERIOD,
            integration_steps=INNER,
            limits="ignore",
        )
        tracked = jffsr.track(robot, target, state, tracker, DURATION)
        largest = jnp.max(jnp.abs(tracked.motion.joint_velocity))
        return jnp.concatenate([tracked.tool_position[-1], largest[None]])

    return one


def jacobians(case: TrackingCase) -> Program:
    """J* (K, 6, n) with what it needs of the inertia."""
    robot = case.robot

    def one(sample):
        q, quaternion, _ = sample
        kin = jffsr.kinematics(robot, jffsr.State(jnp.zeros(3), quaternion, q))
        return response(robot, kin, jnp.zeros(6), None, FLOATING).jacobian

    return _over_batch(one, case.postures)


def steps(case: TrackingCase) -> Program:
    """Joints, base pose and singular values (K, n + 13) of one step."""
    return _over_batch(_step(case), case.postures)


def steps_alone(case: TrackingCase) -> Program:
    """The same of the first few, one call after another."""
    return _one_by_one(_step(case), [tuple(x[k] for x in case.postures) for k in range(ALONE)])


def _step(case: TrackingCase):
    robot = case.robot
    tracker = jffsr.Tracker(integration_steps=INNER)

    def one(sample):
        q, quaternion, twist = sample
        state = jffsr.State(jnp.zeros(3), quaternion, q)
        answer = response(robot, jffsr.kinematics(robot, state), jnp.zeros(6), None, FLOATING)
        damping = raised_cosine(LARGEST, EPSILON)
        rates, sigma = rates_and_values(ADAPTIVE, answer.jacobian, twist, damping)
        motion = rollout_grid(robot, _held_grid(q, rates, PERIOD, tracker), state, jnp.zeros(6), FLOATING)
        return jnp.concatenate(
            [q + PERIOD * rates, motion.base_position[-1], motion.base_quaternion[-1], sigma]
        )

    return one


def decompositions(case: TrackingCase) -> Program:
    """Damped inverses and singular values of J*, as the tracker has them."""
    damping = raised_cosine(LARGEST, EPSILON)
    return _over_batch(lambda jacobian: _flat(*inverse_and_values(jacobian, damping)), _matrices(case))


def decompositions_lapack(case: TrackingCase) -> Program:
    """The same by the library's decomposition of a batch, which takes one matrix after another."""

    def one(jacobian):
        u, sigma, vh = jnp.linalg.svd(jacobian, full_matrices=False)
        lamb = jnp.where(sigma < EPSILON, 0.5 * LARGEST * (1 + jnp.cos(jnp.pi * sigma / EPSILON)), 0.0)
        return _flat((vh.T * (sigma / (sigma**2 + lamb**2))) @ u.T, sigma)

    return _over_batch(one, _matrices(case))


def _flat(inverse, sigma):
    return jnp.concatenate([inverse.ravel(), sigma])


def _matrices(case: TrackingCase):
    return jnp.asarray(jacobians(case).run())
