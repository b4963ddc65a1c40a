"""The filter's steps against finite differences, the motion itself, and the information form."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jffsr.errors import InputError
from jffsr.target.body import Target
from jffsr.target.estimate import NUM_ERRORS, corrected, error_of, true_estimate
from jffsr.target.filter import FilterSettings, chi_square_bounds, expected_innovation_squared
from jffsr.target.filter_steps import ProcessNoise, advance, update_step
from jffsr.target.grasp_frames import grasp_frame
from jffsr.target.prediction import ConvergenceTolerances, has_converged, predict_grasp
from jffsr.target.prior import TargetPrior, draw_from_prior
from jffsr.target.target_state import TargetState
from jffsr.target.tumbling import target_motion

NOISE = np.diag(np.repeat([1e-4, 1.2e-3], 3))
HALF = np.sqrt(0.5)
TARGET = Target.create(
    (0.654, 0.95, 1.0),
    marker=((-0.2, 0.1, 0.3), (0.5, -0.5, 0.5, 0.5)),
    grasps={"ring": ((-0.351, 0.008, -0.428), (HALF, -HALF, 0, 0))},
)
START = TargetState.create(
    (2.4, 0, -0.5), (0.01, 0.02, -0.01), (HALF, HALF, 0, 0), np.deg2rad([8.594, 2.865, 0])
)
QUIET = ProcessNoise()


@pytest.fixture(scope="module")
def estimate():
    prior = TargetPrior.create((0.1, -0.2, 0.15), inertia_deviation=0.3)
    drawn = draw_from_prior(prior, jax.random.key(4))
    root = 1e-3 * np.random.default_rng(5).standard_normal((NUM_ERRORS, NUM_ERRORS))
    return replace(drawn, covariance=jnp.asarray(root @ root.T + 1e-6 * np.eye(NUM_ERRORS)))


def test_the_transition_matrix_is_the_steps_derivative(estimate):
    step = jax.jit(lambda error: advance(corrected(estimate, error), 0.1, 8))
    end, transition = step(jnp.zeros(NUM_ERRORS))
    h = 1e-5
    columns = [
        (error_of(end, step(h * e)[0]) - error_of(end, step(-h * e)[0])) / (2 * h) for e in np.eye(NUM_ERRORS)
    ]
    np.testing.assert_allclose(transition, np.stack(columns, axis=1), atol=1e-9)


def test_a_correction_is_the_one_of_the_information_form(estimate):
    # So small an innovation that the reset of the attitude is nothing.
    small = 1e-7 * np.arange(1.0, 7.0)
    position = np.asarray(estimate.marker_position) + small[:3]
    now = Rotation.from_quat(estimate.quaternion, scalar_first=True)
    measured = (now * Rotation.from_rotvec(small[3:])).as_quat(scalar_first=True)
    update = jax.jit(lambda seen, gate: update_step(estimate, position, measured, seen, NOISE, gate))
    new, residual, squared, used = update(True, 20.0)
    assert used
    np.testing.assert_allclose(residual, small, atol=1e-13)
    rows = np.zeros((6, NUM_ERRORS))
    rows[:3, 11:14] = rows[3:, :3] = np.eye(3)
    before = np.asarray(estimate.covariance)
    covariance = np.linalg.inv(np.linalg.inv(before) + rows.T @ np.linalg.inv(NOISE) @ rows)
    np.testing.assert_allclose(new.covariance, covariance, atol=1e-9)
    np.testing.assert_allclose(
        error_of(estimate, new), covariance @ rows.T @ np.linalg.inv(NOISE) @ small, atol=1e-11
    )
    np.testing.assert_allclose(
        squared, small @ np.linalg.inv(rows @ before @ rows.T + NOISE) @ small, rtol=1e-5
    )
    for seen, gate in ((False, 20.0), (True, 0.5 * float(squared))):
        kept, _, _, used = update(seen, gate)
        assert not used
        for a, b in zip(jax.tree.leaves(kept), jax.tree.leaves(estimate), strict=True):
            assert np.array_equal(a, b)


def test_the_truth_predicted_is_the_targets_motion():
    truth = true_estimate(TARGET, START)
    np.testing.assert_allclose(truth.position, START.position, atol=1e-14)
    np.testing.assert_allclose(truth.velocity, START.velocity, atol=1e-14)
    np.testing.assert_allclose(truth.inertia_ratios, [0.654, 0.95, 1.0], atol=1e-12)
    predicted = predict_grasp(truth, 31.4, TARGET.grasp_in_marker("ring"), num_steps=24)
    position, quaternion, twist = grasp_frame(TARGET, target_motion(TARGET, START, 31.4)(31.4), "ring")
    np.testing.assert_allclose(predicted.position, position, atol=1e-11)
    np.testing.assert_allclose(predicted.twist, twist, atol=1e-11)
    turn = Rotation.from_quat(quaternion, scalar_first=True).inv() * Rotation.from_quat(
        predicted.quaternion, scalar_first=True
    )
    assert turn.magnitude() < 1e-11
    assert abs(float(predicted.time) - 31.4) < 1e-12


@pytest.mark.slow
def test_a_predictions_covariance_is_that_of_many_predictions():
    truth = true_estimate(TARGET, START)
    deviation = 1e-3 * np.repeat([1.0, 0.2, 1.0, 1.0, 0.3, 1.0], [3, 3, 5, 3, 3, 3])
    frame = TARGET.grasp_in_marker("ring")

    def predicted(error):
        moved = replace(corrected(truth, error), covariance=jnp.diag(deviation**2))
        return predict_grasp(moved, 10.0, frame, QUIET, 4)

    draws = deviation * np.random.default_rng(6).standard_normal((1000, NUM_ERRORS))
    middle, many = jax.jit(lambda e: (predicted(jnp.zeros(NUM_ERRORS)), jax.vmap(predicted)(e)))(draws)
    turn = Rotation.from_quat(middle.quaternion, scalar_first=True).inv() * Rotation.from_quat(
        many.quaternion, scalar_first=True
    )
    errors = np.concatenate(
        [many.position - middle.position, turn.as_rotvec(), many.twist - middle.twist], axis=1
    )
    root = np.linalg.cholesky(np.asarray(middle.covariance))
    white = np.linalg.solve(root, errors.T)
    # Sampling leaves 0.045 on the variances and 0.032 between them, at one standard deviation.
    np.testing.assert_allclose(white @ white.T / 1000, np.eye(12), atol=0.16)


def test_convergence_asks_for_every_direction():
    truth = predict_grasp(true_estimate(TARGET, START), 0.0, TARGET.grasp_in_marker(), QUIET, 1)
    # The radius that holds 99 % of a normal law in three dimensions is 3.3682 deviations.
    good = np.repeat(np.array([0.01, np.deg2rad(2), 0.01, 0.01]) / 3.3683, 3)
    assert has_converged(replace(truth, covariance=jnp.diag(good**2)))
    for k in range(12):
        worse = good.copy()
        worse[k] *= 1.001
        assert not has_converged(replace(truth, covariance=jnp.diag(worse**2)))
    with pytest.raises(InputError, match="position is 0"):
        ConvergenceTolerances(position=0.0)
    with pytest.raises(InputError, match="confidence is 1"):
        ConvergenceTolerances(confidence=1.0)


def test_chi_square_numbers_and_refused_settings():
    rng = np.random.default_rng(7)
    draws = np.sum(rng.standard_normal((400000, 6)) ** 2, axis=1)
    settings = FilterSettings(gate_probability=0.9)
    passed = draws[draws <= settings.gate]
    np.testing.assert_allclose(len(passed) / len(draws), 0.9, atol=2e-3)
    np.testing.assert_allclose(passed.mean(), expected_innovation_squared(settings), rtol=5e-3)
    low, high = chi_square_bounds(20, 200)
    np.testing.assert_allclose([low, high], 20 + np.array([-1, 1]) * 1.96 * np.sqrt(2 * 20 / 200), atol=0.03)
    with pytest.raises(InputError, match="gate_probability is 1"):
        FilterSettings(gate_probability=1.0)
    with pytest.raises(InputError, match="acquisition is 0"):
        FilterSettings(acquisition=0)
    with pytest.raises(InputError, match="refit_every is 0"):
        FilterSettings(refit_every=0)
    with pytest.raises(InputError, match="angular_acceleration is -1"):
        ProcessNoise(angular_acceleration=-1.0)
