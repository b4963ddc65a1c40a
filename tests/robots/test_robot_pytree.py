"""A robot is a pytree: numbers are differentiable, the topology is static, other masses do not retrace."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.robots.builder import build_robot
from jffsr.robots.loading import describe_robot
from jffsr.robots.state import State
from jffsr.rollouts.rollout import rollout
from jffsr.trajectories.sine_polynomial import SinePolynomial

TWO_ARMS = Path(__file__).parents[1] / "data" / "robots" / "two_arms.yaml"
FIELDS = ("mass", "inertia", "link_com", "joint_position", "joint_axis", "joint_rotation")


def _loss(robot):
    """A number that every part of the robot moves: where the base ends after a short motion."""
    n = robot.num_joints
    law = SinePolynomial.between(np.full(n, -0.3), np.full(n, 0.4), np.full(n, -1.0), np.full(n, 1.0), 4.0)
    state = State(jnp.zeros(3), jnp.array([1.0, 0, 0, 0]), jnp.zeros(n))
    momentum = jnp.array([0.5, -0.2, 0.1, 0.3, 0.4, -0.6])
    motion = rollout(robot, law, state, num_steps=5, momentum=momentum)
    weights = jnp.array([1.0, -2.0, 3.0])
    return motion.base_position[-1] @ weights + motion.base_quaternion[-1, 1:] @ weights[::-1]


@pytest.fixture(scope="module")
def compiled():
    """Robot, value function that counts its traces, and gradient.

    The robot is the first arm of two_arms without its hand: one joint of each type, both in tilted frames.
    """
    whole = describe_robot(TWO_ARMS)
    arm = dataclasses.replace(
        whole,
        links=tuple(link for link in whole.links if link.name in ("base", "left_upper", "left_slide")),
        joints=tuple(joint for joint in whole.joints if joint.name in ("left_shoulder", "left_extend")),
        end_effectors=(),
    )
    robot = jax.tree.map(jnp.asarray, build_robot(arm))
    chex.clear_trace_counter()
    return robot, jax.jit(chex.assert_max_traces(_loss, n=1)), jax.jit(jax.grad(_loss))(robot)


@pytest.mark.slow
@pytest.mark.parametrize("field", FIELDS)
def test_gradient_is_the_finite_difference(compiled, field):
    """Along one random direction of each field: a wrong or missing part would show."""
    robot, value, gradient = compiled
    array = getattr(robot, field)
    direction = np.random.default_rng(9).normal(size=array.shape)
    if field == "inertia":
        direction = direction + np.swapaxes(direction, -1, -2)
    found = np.sum(getattr(gradient, field) * direction)
    step = 1e-5

    def shifted(by):
        return value(robot.replace(**{field: array + by * step * direction}))

    expected = (8 * (shifted(1) - shifted(-1)) - (shifted(2) - shifted(-2))) / (12 * step)
    assert abs(expected) > 1e-3, "the number does not depend on this field: the test shows nothing"
    np.testing.assert_allclose(found, expected, rtol=1e-7)


@pytest.mark.slow
def test_all_gradients_are_finite(compiled):
    robot, _, gradient = compiled
    chex.assert_trees_all_equal_shapes(gradient, robot)
    chex.assert_tree_all_finite(gradient)


@pytest.mark.slow
def test_other_numbers_do_not_retrace(compiled):
    """The counter raises on a second trace of the function behind `value`."""
    robot, value, _ = compiled
    heavier = value(robot.replace(mass=1.5 * robot.mass))
    longer = value(robot.replace(joint_position=1.1 * robot.joint_position))
    assert len({float(value(robot)), float(heavier), float(longer)}) == 3


def test_topology_is_static_and_decides_equality_of_structure(robots):
    left, right = robots["wu_2018_6dof"], robots["servicer_7dof"]
    assert jax.tree.structure(left) != jax.tree.structure(right)
    assert hash(left.topology) == hash(left.replace(mass=2 * left.mass).topology)
