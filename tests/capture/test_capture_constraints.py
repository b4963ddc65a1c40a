"""The capture's constraints and starts against finite differences of the motion itself."""

from __future__ import annotations

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jffsr
from jffsr.capture.approach import ApproachCone, approach_velocity
from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.match import GraspMatch
from jffsr.capture.problem import capture_problem
from jffsr.capture.starts import bent, capture_starts, ending_so, rates_at
from jffsr.capture.tool_motion import tool_samples
from jffsr.robots.stacking import stacked
from jffsr.rollouts.rollout import rollout
from jffsr.spatial.rotation import quaternion_to_matrix, rotation_vector_to_quaternion
from jffsr.target.body import Target
from jffsr.target.target_state import TargetState
from jffsr.target.tumbling import target_motion

DURATION = 20.0
NUM_STEPS = 400
MOMENTUM = np.array([0.5, -0.3, 0.2, 1.0, 2.0, -1.5])
START = np.deg2rad([0.0, -60.0, 0.0, 45.0, 0.0, -15.0, 0.0])


@pytest.fixture(scope="module")
def path():
    target = Target.create(
        (0.65, 0.95, 1.0), grasps={"handle": ((-0.4, 0.1, -0.2), (np.sqrt(0.5), -np.sqrt(0.5), 0.0, 0.0))}
    )
    start = TargetState.create((2.4, 0.0, -0.5), (0.01, 0.0, -0.02), (0.8, 0.0, 0.6, 0.0), (0.1, 0.05, 0.02))
    motion = target_motion(target, start, 40.0, 24)
    return GraspPath.create(motion, "handle", begin=5.0)


@pytest.fixture(scope="module")
def problem(path):
    robot = jffsr.load_robot("servicer_7dof")
    state = jffsr.State(np.array([0.1, 0.0, -0.1]), np.array([0.9, 0.1, -0.3, 0.3]) / 1.0, START)
    return capture_problem(robot, path, state, DURATION, num_steps=NUM_STEPS, momentum=MOMENTUM)


@pytest.fixture(scope="module")
def moved(problem, path):
    """The free numbers, the motion, the tool's samples, the grasp frames there, and the constraints."""
    rng = np.random.default_rng(3)
    low, high = problem.bounds()
    free = np.clip(np.tile(START, 5) + rng.uniform(-0.4, 0.4, 35), low, high)

    @jax.jit
    def everything(free):
        motion = problem.motion(free)
        tool = tool_samples(problem.robot, motion)
        frames = jax.vmap(lambda t: path.frame(t, motion.time[-1]))(tool.time)
        speeds = jax.vmap(lambda t, p, v: approach_velocity(path, t, DURATION, p, v))(
            tool.time, tool.position, tool.twist[:, :3]
        )
        match = GraspMatch(path).equality(problem.robot, motion)
        cone = ApproachCone(path, 0.5).inequality(problem.robot, motion)
        return motion, tool, frames, speeds, match, cone

    return free, *jax.device_get(everything(free))


def derivative(values, step):
    """Central differences of fourth order at the samples from the third to the last but two."""
    v = np.asarray(values)
    return (v[:-4] - 8 * v[1:-3] + 8 * v[3:-1] - v[4:]) / (12 * step)


def test_the_tools_velocity_is_the_derivative_of_its_position(moved):
    _, _, tool, *_ = moved
    step = DURATION / NUM_STEPS
    np.testing.assert_allclose(tool.twist[2:-2, :3], derivative(tool.position, step), atol=2e-6)


def test_match_is_the_difference_of_both_frames(moved):
    _, _, tool, (origin, quaternion, twist), _, match, _ = moved
    chex.assert_shape(match, (12,))
    np.testing.assert_allclose(match[:3], tool.position[-1] - origin[-1], atol=1e-12)
    np.testing.assert_allclose(match[6:], tool.twist[-1] - twist[-1], atol=1e-12)
    turned = quaternion_to_matrix(rotation_vector_to_quaternion(jnp.asarray(match[3:6])))
    wanted, found = (
        np.asarray(quaternion_to_matrix(jnp.asarray(q[-1]))) for q in (quaternion, tool.quaternion)
    )
    np.testing.assert_allclose(wanted @ turned, found, atol=1e-12)


def test_the_grasp_frames_twist_is_the_derivative_of_its_origin(moved):
    _, _, _, (origin, _, twist), *_ = moved
    np.testing.assert_allclose(twist[2:-2, :3], derivative(origin, DURATION / NUM_STEPS), atol=1e-6)


def test_relative_velocity_is_the_derivative_of_the_place_in_the_grasp_frame(moved):
    _, _, tool, (origin, quaternion, _), (along, length), _, cone = moved
    rotation = np.asarray(jax.vmap(quaternion_to_matrix)(jnp.asarray(quaternion)))
    place = np.einsum("kji,kj->ki", rotation, tool.position - origin)
    velocity = derivative(place, DURATION / NUM_STEPS)
    np.testing.assert_allclose(along[2:-2], velocity[:, 0], atol=4e-6)
    np.testing.assert_allclose(length[2:-2], np.linalg.norm(velocity, axis=1), atol=4e-6)
    # The corrected corridor: the component along the axis is at least |v| cos(gamma).
    at = NUM_STEPS - NUM_STEPS // 50 * np.array([5, 4, 3, 2, 1])
    np.testing.assert_allclose(cone, (length * np.cos(0.5) - along)[at] / 0.01, atol=1e-9)


def test_a_spline_ends_as_it_is_told(problem):
    rng = np.random.default_rng(0)
    position, rate, second = rng.uniform(-1, 1, 7), rng.uniform(-0.1, 0.1, 7), rng.uniform(-0.02, 0.02, 7)
    inner = ending_so(problem.trajectory, position, rate, second)
    law = problem.trajectory.with_free(inner.ravel())
    for found, asked in zip(law(DURATION), (position, rate, second), strict=True):
        np.testing.assert_allclose(found, asked, atol=1e-12)
    for found, asked in zip(law(0.0), (START, np.zeros(7), np.zeros(7)), strict=True):
        np.testing.assert_allclose(found, asked, atol=1e-12)


def test_a_bent_way_comes_near_to_its_bow_and_ends_as_before(problem):
    state, bow = problem.initial_state, np.linspace(-0.2, 0.3, 7)
    many = capture_problem(problem.robot, problem.constraints[0].path, state, DURATION, control_points=14)
    for case, near in ((problem, 0.4), (many, 0.05)):
        law, rng = case.trajectory, np.random.default_rng(1)
        inner = rng.uniform(-0.5, 0.5, law.inner.shape)
        before, after = (law.with_free(np.ravel(x)) for x in (inner, bent(law, inner, bow)))
        share = np.linspace(0, 1, 41)
        moved = after.on_grid(share * DURATION)[0] - before.on_grid(share * DURATION)[0]
        asked = bow[:, None] * 64 * share**3 * (1 - share) ** 3
        assert np.max(np.abs(moved - asked)) < near * np.max(np.abs(bow))
        for found, same in zip(after(DURATION), before(DURATION), strict=True):
            np.testing.assert_allclose(found, same, atol=1e-12)


@pytest.mark.slow
def test_a_start_comes_to_a_still_target_along_its_axis(problem):
    """Relative velocity just before contact points along the frame's x axis, and not against it."""
    target = Target.create((1.0, 1.0, 1.0), grasps={"handle": ((-0.4, 0.0, 0.0), (0.8, 0.0, 0.6, 0.0))})
    still = TargetState.create((2.0, 0.0, -1.5), np.zeros(3), (0.96, 0.28, 0.0, 0.0), np.zeros(3))
    path = GraspPath.create(target_motion(target, still, 40.0, 24))
    state = jffsr.State(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), START)
    case = capture_problem(problem.robot, path, state, DURATION, num_steps=NUM_STEPS)
    posture = np.deg2rad([10.0, -30.0, 20.0, 30.0, 15.0, -40.0, 5.0])
    base = (state.base_position, state.base_quaternion)
    # Where the base is in the end follows from the way there: twice is near enough.
    for _ in range(2):
        given = (posture, *base, np.zeros(7))
        start = capture_starts(
            stacked([case]), stacked([path]), *(x[None, None] for x in given), np.array([0.01]), None
        )[0, 0]
        motion = jax.device_get(jax.jit(case.motion)(start))
        base = (motion.base_position[-1], motion.base_quaternion[-1])
    tool = tool_samples(case.robot, motion, None, [NUM_STEPS - 8])[0]
    along, length = approach_velocity(path, tool.time, DURATION, tool.position, tool.twist[:3])
    assert 0.5 < along / (0.01 * 8 * DURATION / NUM_STEPS) < 2
    assert along > 0.9 * length


def test_rates_at_the_grasp_move_the_tool_as_asked(problem):
    """The joints go on with the rates and accelerations found; differences of the tool's pose say what it does."""
    state = jffsr.State(
        np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), np.deg2rad([10, -30, 20, 30, 15, -40, 5.0])
    )
    twist = np.array([0.05, -0.02, 0.03, 0.04, -0.03, 0.02])
    acceleration = np.array([0.01, 0.02, -0.01, 0.005, 0.0, -0.004])
    step = 0.02

    @jax.jit
    def tool():
        rate, second = rates_at(problem, state, twist, acceleration)

        def law(time):
            return state.joint_position + rate * time + second * time**2 / 2, rate + second * time, second

        return tool_samples(problem.robot, rollout(problem.robot, law, state, 4 * step, 4, MOMENTUM))

    found = jax.device_get(tool())
    np.testing.assert_allclose(found.twist[0], twist, atol=1e-6)
    onwards = np.array([-25, 48, -36, 16, -3]) / (12 * step)
    np.testing.assert_allclose(onwards @ found.position, twist[:3], atol=1e-6)
    np.testing.assert_allclose(onwards @ found.twist, acceleration, atol=1e-5)
