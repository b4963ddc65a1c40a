"""Lines, their timing and the twist they ask for: SciPy's slerp, closed forms, differences, gradients, refusals."""

from __future__ import annotations

from dataclasses import replace

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp
from tool_differences import differenced_twists, sample

import jffsr
from jffsr.errors import InputError
from jffsr.spatial.euler import euler_to_quaternion
from jffsr.spatial.rotation import quaternion_multiply, quaternion_to_matrix
from jffsr.trajectories.cartesian.line import Line
from jffsr.trajectories.cartesian.timing import Quintic, Trapezoid
from jffsr.trajectories.cartesian.tool_trajectory import ToolTrajectory

START = ([1.37, -0.08, 0.64], [-3.14, 0, -2.97])
GOAL = ([1.50, 0.0, -0.2], [-3.16, -0.26, -3.14])
TIMINGS = {"trapezoid": Trapezoid.over(15.0), "quintic": Quintic.over(15.0)}


@jax.jit
def loss(trajectory):
    target = trajectory(jnp.array(6.1))
    return jnp.sum(jnp.sin(3 * jnp.concatenate([*target])))


gradient = jax.jit(jax.grad(loss))


def published(timing=TIMINGS["trapezoid"]):
    return ToolTrajectory(Line.between(START, GOAL, "-xyz"), timing)


def test_line_is_the_straight_way_and_slerp():
    """The attitude's ends are the transposed Rx Ry Rz of the paper's angles."""
    found = sample(published(), np.linspace(0, 15, 31))
    s, *_ = jax.vmap(TIMINGS["trapezoid"])(np.linspace(0, 15, 31))
    ends = Rotation.from_euler("XYZ", [START[1], GOAL[1]]).inv()
    expected = Slerp([0, 1], ends)(np.clip(s, 0, 1)).as_matrix()
    np.testing.assert_allclose(quaternion_to_matrix(found.quaternion), expected, rtol=0, atol=2e-15)
    straight = np.array(START[0]) + np.asarray(s)[:, None] * (np.array(GOAL[0]) - START[0])
    np.testing.assert_allclose(found.position, straight, rtol=0, atol=1e-15)
    # Constant axis: the angular velocity has one direction.
    omega = found.twist[1:-1, 3:]
    turn = (ends[1] * ends[0].inv()).as_rotvec()
    np.testing.assert_allclose(np.cross(omega, turn), 0, rtol=0, atol=1e-16)
    np.testing.assert_allclose(found.twist[15], np.append(straight[-1] - straight[0], turn) / 12, atol=1e-15)


@pytest.mark.parametrize("name", TIMINGS)
def test_twist_and_acceleration_are_those_of_the_poses(name):
    trajectory = published(TIMINGS[name])
    times = np.array([0.4, 1.9, 3.5, 7.3, 11.5, 13.2, 14.6])
    found = sample(trajectory, times)
    twist, acceleration = differenced_twists(trajectory, times)
    np.testing.assert_allclose(found.twist, twist, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.acceleration, acceleration, rtol=0, atol=1e-12)


def test_trapezoid_is_the_closed_form():
    law = Trapezoid.over(10.0, 0.25)
    s, rate, acceleration = jax.vmap(law)(jnp.array([-1.0, 0.0, 1.25, 2.5, 5.0, 7.5, 8.75, 10.0, 11.0]))
    peak = 1 / 7.5
    ramp = peak * 2.5 / 2
    np.testing.assert_allclose(
        s, [0, 0, ramp / 4, ramp, 0.5, 1 - ramp, 1 - ramp / 4, 1, 1], rtol=0, atol=1e-15
    )
    np.testing.assert_allclose(rate, peak * np.array([0, 0, 0.5, 1, 1, 1, 0.5, 0, 0]), rtol=0, atol=1e-16)
    slope = peak / 2.5
    np.testing.assert_allclose(acceleration[jnp.array([0, 2, 4, 6, 8])], [0, slope, 0, -slope, 0], atol=1e-16)


def test_trapezoids_gradients_equal_differences_in_each_of_its_parts():
    at = jax.jit(lambda d, r, t: jnp.stack(Trapezoid(d, r)(t)))
    slopes = jax.jit(jax.jacfwd(lambda d, r, t: jnp.stack(Trapezoid(d, r)(t)), argnums=(0, 1)))
    for time in (0.0, 1.1, 5.0, 9.2, 10.0):
        found = slopes(10.0, 0.25, time)
        assert np.all(np.isfinite(found))
        for slope, step in zip(found, ((1e-6, 0.0), (0.0, 1e-6)), strict=True):
            if 0 < time < 10:
                ahead, behind = (
                    at(10.0 + step[0], 0.25 + step[1], time),
                    at(10.0 - step[0], 0.25 - step[1], time),
                )
                np.testing.assert_allclose(slope, (ahead - behind) / 2e-6, rtol=0, atol=1e-9)


def test_quintic_rests_at_the_ends_and_beyond():
    s, rate, acceleration = jax.vmap(Quintic.over(4.0))(jnp.array([-1.0, 0.0, 2.0, 4.0, 5.0]))
    np.testing.assert_allclose(s, [0, 0, 0.5, 1, 1], rtol=0, atol=1e-15)
    np.testing.assert_allclose(rate, [0, 0, 1.875 / 4, 0, 0], rtol=0, atol=1e-15)
    np.testing.assert_allclose(acceleration, 0, rtol=0, atol=1e-15)


def test_signs_of_the_quaternions_do_not_matter():
    trajectory = published()
    line = trajectory.path
    for signs in ((-1, 1), (1, -1), (-1, -1)):
        turned = replace(
            line,
            start_quaternion=signs[0] * line.start_quaternion,
            goal_quaternion=signs[1] * line.goal_quaternion,
        )
        found, same = (sample(replace(trajectory, path=x), np.array([2.0, 9.0])) for x in (turned, line))
        for part in ("twist", "acceleration"):
            np.testing.assert_allclose(getattr(found, part), getattr(same, part), rtol=0, atol=1e-15)
        np.testing.assert_allclose(
            *(quaternion_to_matrix(x.quaternion) for x in (found, same)), rtol=0, atol=1e-15
        )


@pytest.mark.parametrize("angle", [0.0, 1e-9, np.pi - 1e-9, np.pi])
def test_no_turn_and_a_half_turn_have_finite_gradients(angle):
    start = np.asarray(euler_to_quaternion(np.array([0.3, -0.5, 1.0]), "ZYX"))
    half = np.array([np.cos(angle / 2), *(np.sin(angle / 2) * np.array([-2, 1, 2]) / 3)])
    goal = np.asarray(quaternion_multiply(half, start))
    line = Line.between(([0, 0, 0], start), ([0, 0, 1], goal))
    chex.assert_tree_all_finite(gradient(ToolTrajectory(line, TIMINGS["quintic"])))
    opposite = replace(line, goal_quaternion=-goal)
    paths = [sample(ToolTrajectory(x, TIMINGS["quintic"]), np.array([7.5])).twist for x in (line, opposite)]
    np.testing.assert_allclose(*paths, rtol=0, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(paths[0][0, 3:]), angle * 0.125, rtol=0, atol=1e-15)


def test_gradients_through_poses_and_duration_equal_differences():
    trajectory = published(TIMINGS["quintic"])
    leaves, structure = jax.tree.flatten(trajectory)
    assert len(leaves) == 5
    for i, slope in enumerate(jax.tree.leaves(gradient(trajectory))):
        flat = np.asarray(leaves[i], dtype=float).ravel()
        for k in range(flat.size):
            values = []
            for step in (1e-6, -1e-6):
                moved = flat.copy()
                moved[k] += step
                parts = [*leaves[:i], moved.reshape(np.shape(leaves[i])), *leaves[i + 1 :]]
                values.append(float(loss(jax.tree.unflatten(structure, parts))))
            np.testing.assert_allclose(np.ravel(slope)[k], (values[0] - values[1]) / 2e-6, rtol=0, atol=2e-9)


def pose_in_time(t):
    """A screw with growing pitch, the quaternion's sign turning on the way."""
    half = 0.2 * t**2
    sign = jnp.where(t < 1.5, 1.0, -1.0)
    return jnp.array([jnp.cos(t), jnp.sin(t), t**2]), sign * jnp.array([jnp.cos(half), 0, 0, jnp.sin(half)])


def test_any_function_of_time_is_a_trajectory():
    trajectory = ToolTrajectory.from_callable(pose_in_time, 3.0)
    times = np.array([0.5, 1.0, 2.5])
    found = sample(trajectory, times)
    zero = 0 * times
    twist = np.stack([-np.sin(times), np.cos(times), 2 * times, zero, zero, 0.8 * times], axis=1)
    change = np.stack([-np.cos(times), -np.sin(times), 2 + zero, zero, zero, 0.8 + zero], axis=1)
    np.testing.assert_allclose(found.twist, twist, rtol=0, atol=1e-14)
    np.testing.assert_allclose(found.acceleration, change, rtol=0, atol=1e-14)
    assert trajectory.duration == 3


def test_any_function_of_s_is_a_path_and_passes_through_a_jit():
    path = jax.tree_util.Partial(lambda turns, s: pose_in_time(turns * s), jnp.array(2.0))
    for way in (path, lambda s: pose_in_time(2 * s)):
        found = sample(jffsr.ToolTrajectory(way, Quintic.over(4.0)), np.array([2.0]))
        np.testing.assert_allclose(found.twist[0, 5], 0.8 * 2 * 1.875 / 4, rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Line.between(([0, 0, 0], [1, 0, 0, 0.01]), GOAL), "start attitude .* a unit quaternion"),
        (lambda: Line.between(START, GOAL), r"start attitude .*angles need a named order.* 4 finite numbers"),
        (lambda: Line.between(START, (GOAL[0][:2], GOAL[1]), "xyz"), "goal position is .* 3 finite numbers"),
        (lambda: Line.between(START, GOAL[0], "xyz"), "goal is .* a pair of position and attitude"),
        (lambda: Line.between(START, ([0, 0, np.nan], GOAL[1]), "xyz"), "goal position is .*nan"),
        (lambda: Line.between(START, GOAL, "xxz"), "Euler order 'xxz' is unknown"),
        (lambda: Trapezoid.over(10.0, 0.0), "ramp_fraction is 0; it must be above 0 and at most 0.5"),
        (lambda: Trapezoid.over(10.0, 0.6), "ramp_fraction is 0.6"),
        (lambda: Trapezoid.over(0.0), "duration is 0 s"),
        (lambda: Quintic.over(np.inf), "duration is inf s"),
        (
            lambda: ToolTrajectory.from_callable(lambda t: (t, 2), 2.0),
            "the path's position at 0 is 0.0; 3 finite",
        ),
        (
            lambda: ToolTrajectory.from_callable(lambda t: (jnp.zeros(3), jnp.ones(4) * t), 2.0),
            r"the path's quaternion at 0 .* has the length 0",
        ),
        (lambda: ToolTrajectory.from_callable(lambda t: 1.0, 2.0), "the path's function gives no pose at 0"),
    ],
)
def test_refusals(make, sentence):
    with pytest.raises(InputError, match=sentence):
        make()


def test_a_quaternion_within_rounding_is_normalised():
    line = Line.between(([0, 0, 0], [1 + 5e-7, 0, 0, 0]), ([0, 0, 0], [0, 1, 0, 0]))
    assert line.start_quaternion.tolist() == [1, 0, 0, 0]
