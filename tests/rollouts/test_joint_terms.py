"""The joint terms of the hot path against those of the plain one, in value and derivatives, for every robot.

Robots with the same tree go through one compiled program, so that the whole catalogue costs five of them; a tree
of the tests brings sliding joints between turning ones (random trees: tests/physics).
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.dynamics.kinematics import kinematics
from jffsr.dynamics.momentum import base_twist
from jffsr.errors import InputError
from jffsr.robots.loading import list_robots
from jffsr.robots.robot import PRISMATIC, REVOLUTE, Robot
from jffsr.robots.state import State
from jffsr.rollouts.hot_path import hot_joint_terms
from jffsr.rollouts.plain_path import plain_joint_terms
from jffsr.rollouts.rollout import rollout

STATES = 4


def _moved(robot: Robot, q, qd, masses, lever):
    """The robot and its motion with the numbers that the derivatives are taken by."""
    changed = robot.replace(
        mass=robot.mass * (1 + masses), joint_position=robot.joint_position + lever, inertia=robot.inertia
    )
    return changed, q, qd


def _value_and_pullback(terms):
    """Terms at the given numbers, and their vector-Jacobian product by joints, masses and lengths."""

    @jax.jit
    @jax.vmap
    def run(robot, q, qd, weights):
        free = (q, qd, jnp.zeros_like(robot.mass), jnp.zeros_like(robot.joint_position))

        def stacked(*free):
            found = terms(*_moved(robot, *free))
            return jnp.stack(jax.tree.leaves(found))

        value, pull_back = jax.vjp(stacked, *free)
        return value, pull_back(weights)

    return run


def _compare(robots: list[Robot]):
    n, rng = robots[0].num_joints, np.random.default_rng(5)
    structure = jax.tree.structure(robots[0])
    leaves = [np.stack(x) for x in zip(*(jax.tree.leaves(robot) for robot in robots), strict=True)]
    stacked = jax.tree.unflatten(structure, leaves)
    q, qd = rng.uniform(-2, 2, (2, len(robots), STATES, n))
    weights = rng.normal(size=(len(robots), 15, STATES))
    value, slopes = _value_and_pullback(hot_joint_terms)(stacked, q, qd, weights)
    expected, expected_slopes = _value_and_pullback(plain_joint_terms)(stacked, q, qd, weights)
    chex.assert_shape(value, (len(robots), 15, STATES))
    np.testing.assert_allclose(value, expected, rtol=1e-12, atol=1e-12)
    for slope, other in zip(slopes, expected_slopes, strict=True):
        for one, another in zip(np.asarray(slope), np.asarray(other), strict=True):
            size = np.linalg.norm(another)
            assert size > 0
            np.testing.assert_allclose(one, another, rtol=0, atol=1e-12 * size)


def _same_trees(robots: dict[str, Robot]) -> dict[tuple, list[str]]:
    groups = defaultdict(list)
    for name in list_robots():
        shapes = tuple(np.shape(leaf) for leaf in jax.tree.leaves(robots[name]))
        topology = robots[name].topology
        groups[topology.parents, topology.joint_types, shapes].append(name)
    return groups


@pytest.mark.parametrize(
    "place", [pytest.param(k, marks=[] if k == 0 else [pytest.mark.slow]) for k in range(5)]
)
def test_every_robot_of_the_catalogue(robots, place):
    groups = list(_same_trees(robots).values())
    assert len(groups) == 5, "a robot with another tree wants a place of its own here"
    _compare([robots[name] for name in groups[place]])


@pytest.mark.slow
@pytest.mark.parametrize("kinds", ["both", "slides"])
def test_a_tree_with_several_tips(robots, kinds):
    robot = robots["two_arms"]
    assert {REVOLUTE, PRISMATIC} == set(robot.topology.joint_types)
    assert len(robot.end_effector_names) == 2
    if kinds == "slides":
        topology = replace(robot.topology, joint_types=(PRISMATIC,) * robot.num_joints)
        robot = robot.replace(topology=topology)
    _compare([robot])


def test_base_rate_is_that_of_the_momentum_equation(robots):
    """The plain path too is held to something else: the 6 x 6 solve for the base twist."""
    robot, rng = robots["two_arms"], np.random.default_rng(6)
    q, qd = rng.uniform(-2, 2, (2, STATES, robot.num_joints))
    angular = rng.normal(size=3)

    def rate(q, qd):
        kin = kinematics(robot, State(jnp.zeros(3), jnp.array([1.0, 0, 0, 0]), q))
        return base_twist(robot, kin, qd, jnp.concatenate([jnp.zeros(3), angular]))[3:]

    expected = jax.jit(jax.vmap(rate))(q, qd)
    for terms in (hot_joint_terms, plain_joint_terms):
        found = jax.jit(terms)(robot, q, qd).base_rate(tuple(angular))
        np.testing.assert_allclose(jnp.stack(found, -1), expected, rtol=1e-12, atol=1e-12)


def test_both_kernels_give_one_motion(robots):
    robot = robots["hu_2011_planar2"]
    state = State(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(2))

    def swing(time):
        return tuple(jnp.array([a * jnp.sin(time), b * jnp.cos(time)]) for a, b in ((1, 1), (1, -1), (-1, 1)))

    def run(kernel):
        return rollout(robot, swing, state, 1.0, 8, np.arange(6.0), kernel=kernel)

    fast, plain = jax.jit(run, static_argnums=0)("fast"), jax.jit(run, static_argnums=0)("plain")
    chex.assert_trees_all_close(fast, plain, rtol=1e-12, atol=1e-12)
    with pytest.raises(InputError, match="kernel is 'fats'; allowed are fast, plain"):
        run("fats")
