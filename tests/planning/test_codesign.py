"""Derivatives by lengths and mounts: against the closed form of one link, and differences of other robots."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from wu6_problems import limited, wu6_problem

from jffsr.errors import InputError
from jffsr.optimizers.registry import Settings
from jffsr.planning.codesign import CoDesign, design_gradient
from jffsr.planning.plan import solve
from jffsr.planning.uncertainty import Uncertainty
from jffsr.robots.builder import build_robot
from jffsr.robots.design import Design, mounted_joints, no_change, redesigned
from jffsr.robots.loading import describe_robot
from jffsr.robots.state import State
from jffsr.rollouts.rollout import rollout

FREE = 0.4 * np.random.default_rng(11).standard_normal(4)
START, GOAL = np.array([1.5, 0.5]), np.array([-1.0, 1.5])


@pytest.fixture(scope="module")
def problem(robots):
    return wu6_problem(limited(robots["hu_2011_planar2"]), 40, 20.0, start=START, goal=GOAL)


def test_no_change_is_the_same_robot(robots):
    for name in ("dual_arm_servicer", "two_arms"):
        same = redesigned(robots[name], no_change(robots[name]))
        jax.tree.map(np.testing.assert_array_equal, robots[name], same)


@pytest.mark.slow
def test_a_whole_turn_of_one_link_answers_as_its_closed_form():
    """The base's turn is -pi (1 + (a - c)/S): Hu's base and first link, the link larger, its joint further out."""
    whole = describe_robot("hu_2011_planar2")
    link = build_robot(
        dataclasses.replace(
            whole, links=whole.links[:2], joints=whole.joints[:1], end_effectors=(), shapes=()
        )
    )

    def closed_form(length, mount):
        m0, m1, r0, l1 = 400.0, 40.0, 0.5 + mount, 0.5 * length
        mu = m0 * m1 / (m0 + m1)
        a, c, b = 3.33 * length**2 + mu * l1**2, 66.67 + mu * r0**2, mu * r0 * l1
        return -jnp.pi * (1 + (a - c) / jnp.sqrt((a + c) ** 2 - 4 * b**2))

    def turn(time):
        s = time / 10.0
        ramp, rate = s**3 * (10 - 15 * s + 6 * s**2), 30 * s**2 * (1 - s) ** 2 / 10.0
        return tuple(2 * jnp.pi * x[None] for x in (ramp, rate, 60 * s * (1 - s) * (1 - 2 * s) / 100.0))

    def simulated(length, mount):
        design = Design(length[None], jnp.zeros((1, 3)).at[0, 0].set(mount))
        state = State(jnp.zeros(3), jnp.array([1.0, 0.0, 0.0, 0.0]), jnp.zeros(1))
        motion = rollout(redesigned(link, design), turn, state, duration=10.0, num_steps=400)
        w, _, _, z = motion.base_quaternion[-1]
        return 2 * jnp.arctan2(z, w)

    at = (jnp.array(1.0), jnp.array(0.0))
    expected = jax.grad(closed_form, argnums=(0, 1))(*at)
    found = jax.jit(jax.grad(simulated, argnums=(0, 1)))(*at)
    np.testing.assert_allclose(found, expected, rtol=1e-8)
    assert np.all(np.abs(expected) > 0.1)


@pytest.mark.slow
def test_the_gradient_is_that_of_robots_built_otherwise(problem):
    robot = problem.robot
    assert mounted_joints(robot) == (0,)
    smooth = jax.jit(lambda problem: problem.smooth_and_value(FREE)[0])

    def longer(link: int, by: float):
        factor = np.ones(2)
        factor[link] += by
        changed = robot.replace(
            link_com=robot.link_com * factor[:, None],
            inertia=robot.inertia * np.array([1.0, *factor**2])[:, None, None],
            joint_position=robot.joint_position * np.array([1.0, factor[0]])[:, None],
            end_effector_position=robot.end_effector_position * factor[1],
        )
        return dataclasses.replace(problem, robot=changed)

    def moved(axis: int, by: float):
        place = robot.joint_position.copy()
        place[0, axis] += by
        return dataclasses.replace(problem, robot=robot.replace(joint_position=place))

    def slope(change, which: int) -> float:
        step = 1e-3
        values = [float(smooth(change(which, k * step))) for k in (-2, -1, 1, 2)]
        return float(np.dot([1 / 12, -2 / 3, 2 / 3, -1 / 12], values) / step)

    found = design_gradient(problem, FREE)
    np.testing.assert_allclose(found.length, [slope(longer, 0), slope(longer, 1)], rtol=1e-6)
    np.testing.assert_allclose(found.mount[0, :2], [slope(moved, 0), slope(moved, 1)], rtol=1e-6)
    assert np.min(np.abs(found.length)) > 1e-3 * np.max(np.abs(found.length))


def test_a_candidate_holds_the_plan_and_the_design(problem):
    together = CoDesign.within(problem, length=0.1, mount=0.3)
    lower, upper = together.bounds()
    np.testing.assert_allclose(lower[4:], [0.9, 0.9, -0.3, -0.3, -0.3])
    np.testing.assert_allclose(upper[4:], [1.1, 1.1, 0.3, 0.3, 0.3])
    unchanged, free = together.split(jnp.array([*FREE, 1.0, 1.0, 0.0, 0.0, 0.0]))
    np.testing.assert_array_equal(free, FREE)
    jax.tree.map(np.testing.assert_array_equal, problem.robot, unchanged.robot)


@pytest.mark.parametrize("keywords", [{"length": 1.0}, {"length": -0.1}, {"mount": np.inf}])
def test_bounds_that_make_no_robot_are_refused(problem, keywords):
    with pytest.raises(InputError, match="is expected"):
        CoDesign.within(problem, **keywords)


def test_an_uncertain_problem_is_refused(problem):
    uncertain = dataclasses.replace(problem, uncertainty=Uncertainty.sampled(problem.robot, 2))
    for ask in (lambda: design_gradient(uncertain, FREE), lambda: CoDesign.within(uncertain)):
        with pytest.raises(InputError, match="the problem has an uncertainty, whose robots"):
            ask()


@pytest.mark.slow
def test_longer_arms_serve_a_task_that_the_robot_alone_does_not_meet(problem):
    """The index to be met is the base's turn: it falls where lengths and mount are free too."""
    settings = Settings(particles=20, evaluations=1000)
    alone = solve(problem, "qpso", settings, seed=1, with_sensitivity=False)
    together = CoDesign.within(problem, length=0.3, mount=0.2)
    chosen = solve(together, "qpso", settings, seed=1, with_sensitivity=False)
    assert chosen.free.shape == alone.free.shape
    assert chosen.cost < alone.cost
    # The plan is that of the robot chosen, checked by the reference path.
    np.testing.assert_allclose(chosen.verification.cost, chosen.cost, rtol=1e-3)
    factors = np.linalg.norm(chosen.problem.robot.link_com, axis=1) / np.linalg.norm(
        problem.robot.link_com, axis=1
    )
    assert np.all((factors >= 0.7) & (factors <= 1.3))
    assert np.ptp([1.0, *factors]) > 1e-3
