"""What holds for every motion: two paths agree, order 4, unit quaternions, twist = derivative of pose."""

from __future__ import annotations

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from motions import Quintic

from jffsr.errors import InputError
from jffsr.robots.state import State
from jffsr.rollouts.reference import reference_rollout
from jffsr.rollouts.rollout import check_steps, rollout
from jffsr.spatial.rotation import quaternion_conjugate, quaternion_multiply

MOMENTUM = np.array([1.0, -2.0, 0.5, 3.0, 2.0, -4.0])
START_ATTITUDE = np.array([0.8, 0.2, -0.4, 0.4])
# A long chain, a planar one and a tree; more chains would compile for long and add nothing.
OTHERS = [pytest.param("servicer_7dof", marks=pytest.mark.slow), "two_arms", "ye_2019_planar3"]


def _setting(robot):
    rng = np.random.default_rng(11)
    start, goal = rng.uniform(-0.6, 0.6, (2, robot.num_joints))
    start = np.where(robot.topology.is_revolute, start, 0.2 * start)
    state = State(np.array([0.3, -0.2, 0.1]), START_ATTITUDE, start)
    return Quintic(start, goal, np.array(8.0)), state


@pytest.fixture(scope="module", params=OTHERS)
def both(request, robots):
    """The same motion by both paths, in steps so fine that their ways to the position do not differ."""
    robot = robots[request.param]
    trajectory, state = _setting(robot)
    momentum = MOMENTUM * np.sum(robot.mass) / 2000
    return [
        jax.jit(lambda r, t, path=path: path(r, t, state, num_steps=500, momentum=momentum))(
            robot, trajectory
        )
        for path in (rollout, reference_rollout)
    ]


def test_both_paths_give_the_same_motion(both):
    fast, plain = both
    chex.assert_trees_all_equal_shapes(fast, plain)
    chex.assert_tree_all_finite(fast)
    np.testing.assert_allclose(fast.base_quaternion, plain.base_quaternion, rtol=0, atol=1e-12)
    np.testing.assert_allclose(fast.base_twist, plain.base_twist, rtol=0, atol=1e-12)
    np.testing.assert_allclose(fast.base_position, plain.base_position, rtol=0, atol=1e-11)


def test_quaternions_have_unit_length(both):
    for motion in both:
        np.testing.assert_allclose(np.linalg.norm(motion.base_quaternion, axis=1), 1, rtol=0, atol=1e-12)


def test_base_twist_is_the_derivative_of_the_base_pose(both):
    for motion in both:
        h = motion.time[1]

        def derivative(x, h=h):
            one, two, three = (x[3 + k : -3 + k or None] - x[3 - k : -3 - k] for k in (1, 2, 3))
            return (45 * one - 9 * two + three) / (60 * h)

        inner = slice(3, -3)
        np.testing.assert_allclose(
            derivative(motion.base_position), motion.base_twist[inner, :3], rtol=0, atol=1e-9
        )
        spin = 2 * quaternion_multiply(
            derivative(motion.base_quaternion), quaternion_conjugate(motion.base_quaternion[inner])
        )
        np.testing.assert_allclose(spin[:, 0], 0, atol=1e-9)
        np.testing.assert_allclose(spin[:, 1:], motion.base_twist[inner, 3:], rtol=0, atol=1e-9)


def test_attitude_converges_with_order_four(robots):
    """Twice the steps, a sixteenth of the error: the final attitude against a 40 times finer motion."""
    robot = robots["hu_2011_planar2"]
    trajectory = Quintic(np.array([0.5, -0.3]), np.array([-0.6, 1.0]), np.array(10.0))
    state = State(np.zeros(3), START_ATTITUDE, np.zeros(2))
    momentum = np.array([5.0, 0, -3, 30.0, -40.0, 60.0])

    def final(steps):
        motion = jax.jit(lambda t: rollout(robot, t, state, num_steps=steps, momentum=momentum))(trajectory)
        return motion.base_quaternion[-1]

    coarse, fine, exact = (final(steps) for steps in (20, 40, 1600))
    errors = np.linalg.norm(coarse - exact), np.linalg.norm(fine - exact)
    assert errors[1] > 1e-10, "too accurate to see an order"
    np.testing.assert_allclose(np.log2(errors[0] / errors[1]), 4.0, atol=0.1)


def test_duration_and_steps_are_checked(robots):
    robot = robots["hu_2011_planar2"]
    trajectory, state = _setting(robot)
    with pytest.raises(InputError, match=r"has no duration of its own: pass duration="):
        rollout(robot, lambda t: (t, t, t), state)
    for wrong in (0, -3, 2.5, True):
        with pytest.raises(InputError, match=r"num_steps is .*; a positive whole number is expected"):
            rollout(robot, trajectory, state, num_steps=wrong)
    assert check_steps(np.int64(5)) == 5


def test_a_plain_callable_is_a_trajectory(robots):
    """A user's own function of time needs nothing but the duration."""
    robot = robots["hu_2011_planar2"]
    state = State(np.zeros(3), START_ATTITUDE, np.zeros(2))

    def swing(time):
        q = jnp.array([0.1, 0.2])
        return q * jnp.sin(time), q * jnp.cos(time), -q * jnp.sin(time)

    motion = jax.jit(lambda d: rollout(robot, swing, state, duration=d, num_steps=4))(5.0)
    np.testing.assert_allclose(motion.time, np.linspace(0, 5, 5), rtol=1e-15)
    np.testing.assert_allclose(motion.joint_position[:, 1], 0.2 * np.sin(motion.time), rtol=1e-14)
    np.testing.assert_array_equal(motion.momentum, np.zeros(6))


def test_vmap_over_robots_and_momenta_is_a_loop(robots):
    robot = robots["hu_2011_planar2"]
    trajectory, state = _setting(robot)

    def run(mass, momentum):
        return rollout(robot.replace(mass=mass), trajectory, state, num_steps=4, momentum=momentum)

    batch = np.stack([robot.mass, 1.3 * robot.mass]), np.stack([np.zeros(6), MOMENTUM])
    together = jax.jit(jax.vmap(run))(*batch)
    alone = jax.tree.map(lambda *x: jnp.stack(x), *map(jax.jit(run), *batch))
    chex.assert_trees_all_close(together, alone, rtol=0, atol=1e-14)
