"""Momentum from body poses: constant along honest motions, and the check fails along wrong ones."""

from __future__ import annotations

import dataclasses

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from motions import Quintic

from jffsr.errors import InputError
from jffsr.robots.state import State
from jffsr.rollouts.conservation import momentum_drift, momentum_from_poses
from jffsr.rollouts.rollout import rollout

STEPS = 200
CONSTANT = 1e-8
CAUGHT = 1e-4
ATTITUDE = np.array([0.8, 0.2, -0.4, 0.4])


@dataclasses.dataclass(frozen=True)
class Case:
    """One robot and one compiled function of mover, judge, momentum, factors of the quaternion and change."""

    robot: object
    change: np.ndarray
    judged: object

    def drift(self, moving=None, judging=None, momentum=(0.0,) * 6, factors=(1.0,) * 4, change=None):
        return float(
            self.judged(
                moving or self.robot,
                judging or self.robot,
                np.array(momentum, dtype=float),
                np.array(factors, dtype=float),
                self.change if change is None else np.array(change),
            )
        )


@pytest.fixture(scope="module", params=["wu_2018_6dof", "hu_2011_planar2", "servicer_7dof"])
def case(request, robots):
    robot = robots[request.param]
    rng = np.random.default_rng(3)
    start = rng.uniform(-0.5, 0.5, robot.num_joints)
    change = rng.uniform(0.4, 1.0, robot.num_joints) * rng.choice([-1, 1], robot.num_joints)

    def judged(moving, judging, momentum, factors, change):
        state = State(jnp.array([0.5, -1.0, 2.0]), ATTITUDE, start)
        trajectory = Quintic(start, start + change, jnp.array(10.0))
        motion = rollout(moving, trajectory, state, num_steps=STEPS, momentum=momentum)
        motion = dataclasses.replace(motion, base_quaternion=motion.base_quaternion * factors)
        return momentum_drift(judging, motion)

    return Case(robot, change, jax.jit(judged))


def _heavier_to_turn(robot):
    """The robot with 10 % more inertia on its bulkiest link."""
    inertia = np.array(robot.inertia)
    inertia[1 + np.argmax(np.trace(inertia[1:], axis1=1, axis2=2))] *= 1.1
    return robot.replace(inertia=inertia)


MOMENTUM = (0.8, -0.5, 1.2, 2.0, -1.0, 3.0)


@pytest.mark.parametrize("momentum", [(0.0,) * 6, MOMENTUM])
def test_honest_motions_keep_their_momentum(case, momentum):
    assert case.drift(momentum=momentum) < CONSTANT


def test_momentum_from_poses_is_the_stated_momentum(robots):
    robot = robots["two_arms"]
    state = State(np.array([0.5, -1.0, 2.0]), ATTITUDE, np.zeros(5))
    trajectory = Quintic(np.zeros(5), np.array([1.0, 0.2, -1.0, -0.2, 0.5]), np.array(10.0))

    @jax.jit
    def measured(momentum):
        return momentum_from_poses(
            robot, rollout(robot, trajectory, state, num_steps=STEPS, momentum=momentum)
        )

    found = measured(np.array(MOMENTUM))
    chex.assert_shape(found, (STEPS - 7, 6))
    np.testing.assert_allclose(found, np.tile(MOMENTUM, (STEPS - 7, 1)), rtol=0, atol=1e-8)


@pytest.mark.parametrize("momentum", [(0.0,) * 6, MOMENTUM])
def test_a_wrong_inertia_is_caught(case, momentum):
    """The motion is computed with 10 % too much inertia on one link and judged with the right one."""
    assert case.drift(moving=_heavier_to_turn(case.robot), momentum=momentum) > CAUGHT


def test_a_wrong_mass_is_caught(case):
    mass = np.array(case.robot.mass)
    mass[-1] *= 1.1
    assert case.drift(moving=case.robot.replace(mass=mass)) > CAUGHT


@pytest.mark.parametrize("momentum", [(0.0,) * 6, MOMENTUM])
def test_a_wrong_sign_in_the_quaternion_is_caught(case, momentum):
    assert case.drift(momentum=momentum, factors=(1, 1, 1, -1)) > CAUGHT


def test_a_robot_at_rest_has_no_drift(case):
    assert case.drift(change=np.zeros(case.robot.num_joints)) < CONSTANT


def test_drift_is_relative(case):
    """A motion a thousand times smaller of a robot with the same fault drifts by the same share."""
    wrong = _heavier_to_turn(case.robot)
    large, small = (case.drift(moving=wrong, change=size * case.change) for size in (0.1, 1e-4))
    np.testing.assert_allclose(small, large, rtol=0.2)


def test_too_few_samples_are_refused(robots):
    robot = robots["hu_2011_planar2"]
    trajectory = Quintic(np.zeros(2), np.ones(2), np.array(10.0))
    state = State(np.zeros(3), ATTITUDE, np.zeros(2))
    with pytest.raises(InputError, match="the motion has 8 samples; momentum from poses needs at least 9"):
        jax.eval_shape(lambda: momentum_drift(robot, rollout(robot, trajectory, state, num_steps=7)))
