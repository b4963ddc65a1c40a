"""Base rotations that are known in closed form or to many digits."""

from __future__ import annotations

import dataclasses
import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.dynamics.kinematics import kinematics
from jffsr.dynamics.momentum import base_twist
from jffsr.robots.builder import build_robot
from jffsr.robots.loading import describe_robot
from jffsr.robots.state import State
from jffsr.rollouts.rollout import rollout

STEPS = 2000


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True)
class LineAndCircle:
    """Joint motion on a line plus once around a circle in the first two joints, at rest at both ends."""

    start: jax.Array
    goal: jax.Array
    radius: jax.Array
    duration: jax.Array

    def _position(self, time):
        s = time / self.duration
        ramp = s**3 * (10 - 15 * s + 6 * s**2)
        turn = 2 * jnp.pi * ramp
        circle = jnp.stack([jnp.cos(turn), jnp.sin(turn)])[: self.start.shape[0]]
        return self.start + (self.goal - self.start) * ramp + self.radius * circle

    def __call__(self, time):
        def rate(t):
            return jax.jvp(self._position, (t,), (jnp.ones_like(t),))[1]

        return self._position(time), rate(time), jax.jvp(rate, (time,), (jnp.ones_like(time),))[1]


def _turn(robot, start, goal, radius=0.0, angle=0.0, duration=10.0):
    """Joint positions and base angle about z, rad, continuous, along a motion; the base starts at `angle`."""
    # One type for every call, so that it compiles once for each robot.
    return _compiled(robot, *(jnp.array(x, dtype=float) for x in (start, goal, radius, angle, duration)))


@jax.jit
def _compiled(robot, start, goal, radius, angle, duration):
    trajectory = LineAndCircle(start, goal, radius, duration)
    attitude = jnp.stack([jnp.cos(angle / 2), 0.0, 0.0, jnp.sin(angle / 2)])
    motion = rollout(robot, trajectory, State(jnp.zeros(3), attitude, trajectory.start), num_steps=STEPS)
    w, _, _, z = motion.base_quaternion.T
    return motion.joint_position, jnp.unwrap(2 * jnp.arctan2(z, w), period=4 * jnp.pi)


@pytest.fixture(scope="module")
def arm(robots):
    return robots["hu_2011_planar2"]


@pytest.fixture(scope="module")
def one_link():
    """The base and the first link of the same arm."""
    whole = describe_robot("hu_2011_planar2")
    return build_robot(
        dataclasses.replace(
            whole, links=whole.links[:2], joints=whole.joints[:1], end_effectors=(), shapes=()
        )
    )


def test_one_link_follows_the_closed_form(one_link):
    m0, m1 = 400.0, 40.0
    i0, i1, r0, l1 = 66.67, 3.33, 0.5, 0.5
    mu = m0 * m1 / (m0 + m1)
    a, c, b = i1 + mu * l1**2, i0 + mu * r0**2, mu * r0 * l1
    root = np.sqrt((a + c) ** 2 - 4 * b**2)
    q, angle = _turn(one_link, np.array([0.0]), np.array([2 * np.pi]))
    q = np.array(q[:, 0])
    branch = np.arctan(np.sqrt((a + c - 2 * b) / (a + c + 2 * b)) * np.tan(q / 2)) + np.pi * np.round(
        q / (2 * np.pi)
    )
    expected = -q / 2 - (a - c) / root * branch
    np.testing.assert_allclose(angle, expected, rtol=0, atol=1e-12)
    np.testing.assert_allclose(angle[-1], -np.pi * (1 + (a - c) / root), rtol=0, atol=1e-12)
    np.testing.assert_allclose(angle[-1], -0.835470417149851, rtol=0, atol=1e-12)


def test_a_square_loop_turns_the_base(arm):
    """The joints return to where they were; the base does not."""
    corners = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1], [0, 0]])
    angle = 0.0
    for start, goal in itertools.pairwise(corners):
        angle = _turn(arm, start, goal, angle=angle)[1][-1]
    np.testing.assert_allclose(angle, -0.0294029714, rtol=0, atol=6e-11)


def test_a_circular_loop_turns_the_base(arm):
    centre = np.array([0, np.pi / 2])
    _, angle = _turn(arm, centre, centre, radius=0.1)
    np.testing.assert_allclose(angle[-1], -0.0021322544, rtol=0, atol=6e-11)


def test_the_published_boundary_conditions_by_a_quintic(arm):
    start, goal = np.deg2rad([90.0, 30.0]), np.deg2rad([-60.0, 90.0])
    _, angle = _turn(arm, start, goal, angle=np.deg2rad(-40.0))
    np.testing.assert_allclose(np.rad2deg(angle[-1]), 19.966184, rtol=0, atol=5e-7)


def test_the_end_does_not_depend_on_the_duration(arm):
    """The momentum equation at zero momentum is free of time: only the joints' path counts."""
    start, goal = np.deg2rad([90.0, 30.0]), np.deg2rad([-60.0, 90.0])
    ends = [_turn(arm, start, goal, duration=duration)[1][-1] for duration in (1.0, 77.0)]
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=1e-13)


def test_the_local_connection(arm):
    """Base rate per joint rate at (90, 30) degrees."""

    @jax.jit
    def connection(robot, q):
        kin = kinematics(robot, State(jnp.zeros(3), jnp.array([1.0, 0, 0, 0]), q))
        return jax.vmap(lambda rate: base_twist(robot, kin, rate)[5])(jnp.eye(2))

    found = connection(arm, np.deg2rad([90.0, 30.0]))
    np.testing.assert_allclose(found, [-0.46294571, -0.12292373], rtol=0, atol=5e-9)
