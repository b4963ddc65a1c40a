"""A free target's motion against Jacobi's elliptic functions, Montgomery's phase and finite differences."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from torque_free import EllipticRotation

from jffsr.target.body import Target
from jffsr.target.grasp_frames import fixed_acceleration, grasp_frame
from jffsr.target.target_state import TargetState
from jffsr.target.tumbling import steps_needed, target_motion

MOMENTS = (30.0, 20.0, 12.0)
GRASPS = {
    "ring": ((0.4, -0.1, 0.2), (0.5, 0.5, -0.5, 0.5)),
    "bolt": ((0.0, 0.3, 0.0), (1.0, 0.0, 0.0, 0.0)),
}
# About the first axis, about the third, and within 0.1 % of the separatrix, where w3/w1 is sqrt(25/8).
CASES = {
    "first": (0.08, 0.05),
    "third": (0.03, 0.15),
    "separatrix": (0.08, 0.08 * 1.7677669529663689 * (1 - 1e-3)),
}


@pytest.fixture(scope="module")
def moved():
    """Ten periods of each case, at 41 times, in one compiled call of 3,200 steps."""
    target = Target.create(MOMENTS, 100.0, grasps=GRASPS)
    truths = {name: EllipticRotation(MOMENTS, *start) for name, start in CASES.items()}
    times = np.stack([np.linspace(0, 10 * truth.period, 41) for truth in truths.values()])
    quaternion = np.array([0.5, -0.5, 0.5, 0.5])

    def one(rate, time):
        state = TargetState(
            jnp.array([1.0, 2.0, 3.0]), jnp.array([0.01, -0.02, 0.03]), jnp.asarray(quaternion), rate
        )
        return jax.vmap(target_motion(target, state, time[-1], 3200))(time)

    rates = jnp.stack([truth.start for truth in truths.values()])
    states = jax.jit(jax.vmap(one))(rates, times)
    return {
        name: (truth, times[i], jax.tree.map(lambda leaf, i=i: np.asarray(leaf[i]), states), quaternion)
        for i, (name, truth) in enumerate(truths.items())
    }


@pytest.mark.parametrize("name", CASES)
def test_ten_periods_follow_jacobis_functions_and_keep_momentum(moved, name):
    truth, times, states, quaternion = moved[name]
    expected = truth.angular_velocity(times)
    error = np.abs(states.angular_velocity_T - expected).max() / np.linalg.norm(truth.start)
    assert error < 1e-9
    rotations = Rotation.from_quat(states.quaternion, scalar_first=True)
    momentum = rotations.apply(np.asarray(MOMENTS) * states.angular_velocity_T)
    start = Rotation.from_quat(quaternion, scalar_first=True).apply(np.asarray(MOMENTS) * truth.start)
    assert np.abs(momentum - start).max() < 1e-11 * truth.momentum
    energy = states.angular_velocity_T**2 @ np.asarray(MOMENTS)
    assert np.abs(energy - truth.twice_energy).max() < 1e-11 * truth.twice_energy
    drift = np.array([1.0, 2.0, 3.0]) + times[:, None] * np.array([0.01, -0.02, 0.03])
    assert np.abs(states.position - drift).max() < 1e-12


def turn_about_momentum(states, sample):
    """Rotation vector in I of the whole turn since the first sample."""
    rotations = Rotation.from_quat(states.quaternion[[0, sample]], scalar_first=True)
    return (rotations[1] * rotations[0].inv()).as_rotvec()


@pytest.mark.parametrize("name", CASES)
def test_attitude_after_periods_has_montgomerys_phase(moved, name):
    truth, _, states, quaternion = moved[name]
    # In a period the momentum is back in the body, so the turn is about it: 2 E T/|L| less the solid angle.
    phase = truth.twice_energy * truth.period / truth.momentum - truth.solid_angle()
    direction = Rotation.from_quat(quaternion, scalar_first=True).apply(np.asarray(MOMENTS) * truth.start)
    direction = direction / truth.momentum
    for periods in (1, 10):
        expected = Rotation.from_rotvec(periods * phase * direction)
        found = Rotation.from_rotvec(turn_about_momentum(states, 4 * periods))
        assert (found * expected.inv()).magnitude() < 1e-9


@pytest.mark.parametrize("name", ["first", "third"])
def test_attitude_between_periods_follows_the_precession_by_quadrature(moved, name):
    truth, times, states, quaternion = moved[name]
    axis = np.eye(3)[0 if truth.about_first else 2]
    start = Rotation.from_quat(quaternion, scalar_first=True)
    direction = start.apply(np.asarray(MOMENTS) * truth.start) / truth.momentum
    sample = 39
    # The axis keeps its angle to the momentum as cos = h_axis/|L|, and turns about it by the precession.
    first, last = (
        start.apply(axis),
        Rotation.from_quat(states.quaternion[sample], scalar_first=True).apply(axis),
    )
    expected = Rotation.from_rotvec(truth.precession(times[sample]) * direction).apply(first)

    def across(v):
        v = v - (v @ direction) * direction
        return v / np.linalg.norm(v)

    assert np.linalg.norm(across(last) - across(expected)) < 1e-9
    momentum = np.asarray(MOMENTS) * truth.angular_velocity(times[sample])
    assert abs(last @ direction - momentum @ axis / truth.momentum) < 1e-9


@pytest.fixture(scope="module")
def turned():
    """A target of full inertia and a function that gives its grasp frame's pose and twist at a time."""
    turn = Rotation.from_euler("ZYX", [0.4, -0.7, 1.1]).as_matrix()
    target = Target.create(turn @ np.diag(MOMENTS) @ turn.T, 100.0, grasps=GRASPS)
    start = TargetState.create((2.4, 0, -0.5), (0.02, 0.01, -0.03), (0.5, 0.5, 0.5, -0.5), (0.15, -0.08, 0.2))

    def grasp(time, inertia, rate):
        body = Target(
            target.mass, inertia, target.marker_position, target.marker_quaternion, target.grasp_position,
            target.grasp_quaternion, target.grasp_names,
        )  # fmt: skip
        state = TargetState(start.position, start.velocity, start.quaternion, rate)
        motion = target_motion(body, state, 20.0, 40)
        now = motion(time)
        acceleration = fixed_acceleration(inertia, now, target.grasp_position[0])
        return *grasp_frame(body, now), acceleration, now

    return target, start, jax.jit(grasp)


def test_axes_of_the_inertia_do_not_matter(turned):
    target, start, grasp = turned
    turn = Rotation.from_euler("ZYX", [0.4, -0.7, 1.1])
    principal = Target.create(MOMENTS, 100.0)
    own = Rotation.from_quat(start.quaternion, scalar_first=True) * turn
    state = TargetState.create(
        start.position,
        start.velocity,
        own.as_quat(scalar_first=True),
        turn.inv().apply(start.angular_velocity_T),
    )
    expected = target_motion(principal, state, 20.0)(17.3)
    found = grasp(17.3, target.inertia, start.angular_velocity_T)[-1]
    back = Rotation.from_quat(expected.quaternion, scalar_first=True) * turn.inv()
    apart = back.inv() * Rotation.from_quat(found.quaternion, scalar_first=True)
    assert apart.magnitude() < 1e-12


def test_grasp_twist_and_acceleration_are_the_rates_of_the_pose(turned):
    target, start, grasp = turned
    h, time = 1e-3, 7.3
    (p0, q0, t0, *_), (p1, q1, t1, *_) = (
        grasp(time + s * h, target.inertia, start.angular_velocity_T) for s in (-1, 1)
    )
    position, quaternion, twist, acceleration, state = grasp(time, target.inertia, start.angular_velocity_T)
    turn = Rotation.from_quat(q1, scalar_first=True) * Rotation.from_quat(q0, scalar_first=True).inv()
    np.testing.assert_allclose(twist, np.append(p1 - p0, turn.as_rotvec()) / (2 * h), atol=2e-8)
    np.testing.assert_allclose(acceleration, (t1 - t0) / (2 * h), atol=2e-8)
    body = Rotation.from_quat(state.quaternion, scalar_first=True)
    np.testing.assert_allclose(position, state.position + body.apply(GRASPS["ring"][0]), atol=1e-14)
    expected = body * Rotation.from_quat(GRASPS["ring"][1], scalar_first=True)
    assert (expected.inv() * Rotation.from_quat(quaternion, scalar_first=True)).magnitude() < 1e-12


def test_gradients_match_finite_differences_and_are_finite_for_any_body(turned):
    target, start, grasp = turned

    def value(time, inertia, rate):
        position, quaternion, twist, *_ = grasp(time, inertia, rate)
        return position @ jnp.array([1.0, -2.0, 0.5]) + quaternion @ jnp.arange(4.0) + jnp.sum(twist)

    gradient = jax.jit(jax.grad(value, argnums=(0, 1, 2)))
    point = (jnp.asarray(9.1), jnp.asarray(target.inertia), jnp.asarray(start.angular_velocity_T))
    rng = np.random.default_rng(0)
    way = [rng.standard_normal(np.shape(x)) for x in point]
    h = 1e-5
    ends = [value(*(x + s * h * d for x, d in zip(point, way, strict=True))) for s in (-1, 1)]
    along = sum(np.sum(g * d) for g, d in zip(gradient(*point), way, strict=True))
    assert abs((ends[1] - ends[0]) / (2 * h) - along) < 1e-7 * abs(along)
    degenerate = [
        (np.eye(3), [0.1, 0.2, 0.3]),  # a sphere
        (np.diag([2.0, 2.0, 1.0]), [0.1, 0.0, 0.3]),  # of revolution
        (np.diag(MOMENTS), [0.0, 0.2, 0.0]),  # unstable spin
        (np.diag(MOMENTS), [0.0, 0.0, 0.0]),  # at rest
    ]
    for inertia, rate in degenerate:
        for part in gradient(0.0, jnp.asarray(inertia), jnp.asarray(rate)):
            assert np.all(np.isfinite(part))
    # A sphere turns at a constant rate.
    state = grasp(20.0, jnp.eye(3), jnp.array([0.1, 0.2, 0.3]))[-1]
    turn = Rotation.from_quat(start.quaternion, scalar_first=True) * Rotation.from_rotvec([2.0, 4.0, 6.0])
    assert (turn.inv() * Rotation.from_quat(state.quaternion, scalar_first=True)).magnitude() < 1e-12


def test_steps_are_as_many_as_the_momentum_asks_for():
    target = Target.create(MOMENTS)
    rest = np.zeros(3)
    state = TargetState.create(rest, rest, (1, 0, 0, 0), (0.1, 0, 0))
    # |J w|/J_min = 30 * 0.1/12 rad/s, a quarter of a radian a step.
    assert steps_needed(target.inertia, state.angular_velocity_T, 100.0) == 100
    assert target_motion(target, state, 100.0).num_steps == 100
