"""Inverse kinematics with a floating base against a rollout that shares no code with it."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jffsr
from jffsr.compiling import jit

START = np.deg2rad([0.0, -60.0, 0.0, 45.0, 0.0, -15.0, 0.0])
DURATION = 30.0
POSES = 6


def reference(robot, state, q, momentum):
    """Base and tool pose at the end of the straight quintic path to q (k, n), by the plain integrator."""
    rest = jnp.zeros(robot.num_joints)

    def one(goal):
        law = jffsr.Polynomial(
            state.joint_position, goal, rest, rest, rest, rest, DURATION, jnp.zeros((robot.num_joints, 0))
        )
        motion = jffsr.reference_rollout(robot, law, state, DURATION, 100, momentum)
        base = motion.base_position[-1], motion.base_quaternion[-1]
        return base, jffsr.end_effector_pose(robot, jffsr.kinematics(robot, jffsr.State(*base, goal)))

    return jit(jax.vmap(one))(q)


@pytest.fixture(scope="module", params=[0.0, 1.0], ids=["at rest", "with momentum"])
def confirmed(request, robots):
    """The seven-axis servicer, poses in I that it can reach, and what was found for them."""
    robot = robots["servicer_7dof"]
    momentum = request.param * np.array([2.0, -1.0, 1.5, 4.0, -3.0, 5.0])
    state = jffsr.State(np.array([0.1, 0.2, -0.3]), np.array([0.5, 0.5, -0.5, 0.5]), START)
    low, high = robot.limits.position_lower, robot.limits.position_upper
    spread = np.random.default_rng(2).uniform(-1.2, 1.2, (POSES, 7))
    goals = jnp.asarray(np.clip(START + spread, 0.9 * low, 0.9 * high))
    _, (position, quaternion) = reference(robot, state, goals, jnp.asarray(momentum))
    found = jffsr.floating_inverse_kinematics(
        robot,
        position,
        quaternion,
        state,
        np.stack([START, START + 0.3]),
        momentum=momentum,
        duration=DURATION,
    )
    return robot, state, momentum, position, found


@pytest.mark.slow
def test_the_tool_is_there_when_the_motion_ends(confirmed):
    robot, state, momentum, position, found = confirmed
    assert bool(np.all(found.best().success))
    flat = found.joint_position.reshape(-1, 7)
    (place, turn), (at, _) = reference(robot, state, flat, jnp.asarray(momentum))
    np.testing.assert_allclose(found.base_position.reshape(-1, 3), place, atol=1e-6)
    sign = np.sign(np.sum(np.asarray(turn) * found.base_quaternion.reshape(-1, 4), axis=1))
    np.testing.assert_allclose(found.base_quaternion.reshape(-1, 4), sign[:, None] * turn, atol=1e-6)
    away = np.linalg.norm(np.asarray(at).reshape(POSES, 2, 3) - position[:, None], axis=-1)
    assert away[np.asarray(found.success)].max() < 3e-6


@pytest.mark.slow
def test_the_base_has_moved(confirmed):
    # A still base would miss by far more than the tolerance, so that the test above says something.
    _, state, _, _, found = confirmed
    moved = np.linalg.norm(np.asarray(found.base_position) - state.base_position, axis=-1)
    assert moved[np.asarray(found.success)].min() > 1e-3


@pytest.mark.slow
def test_a_held_base_gives_the_solution_of_a_still_one(robots):
    robot = robots["wu_2018_6dof"]
    q = jnp.array([0.3, -0.6, -0.9, 0.2, 0.8, -0.4])
    state = jffsr.State(jnp.array([1.0, 2.0, 3.0]), jnp.array([1.0, 0.0, 0.0, 0.0]), jnp.zeros(6))
    kin = jffsr.kinematics(robot, jffsr.State(state.base_position, state.base_quaternion, q))
    position, quaternion = jffsr.end_effector_pose(robot, kin)
    held = jffsr.floating_inverse_kinematics(
        robot, position, quaternion, state, (q + 0.2)[None], base_mode="fixed", iterations=1, num_steps=2
    )
    still = jffsr.inverse_kinematics(robot, position - state.base_position, quaternion, (q + 0.2)[None])
    assert bool(held.success[0])
    np.testing.assert_allclose(held.joint_position, still.joint_position, atol=1e-9)
    np.testing.assert_array_equal(held.base_position[0], state.base_position)


def test_momentum_without_a_duration_is_refused(robots):
    robot = robots["wu_2018_6dof"]
    state = jffsr.State(jnp.zeros(3), jnp.array([1.0, 0.0, 0.0, 0.0]), jnp.zeros(6))
    with pytest.raises(jffsr.InputError, match="pass duration="):
        jffsr.floating_inverse_kinematics(
            robot, np.zeros(3), np.array([1.0, 0, 0, 0]), state, np.zeros((1, 6)), momentum=np.ones(6)
        )
