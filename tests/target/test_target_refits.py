"""All poses fitted together: normal equations, and the covariance of what they leave open."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jffsr.target.body import Target
from jffsr.target.camera import Camera, Measurements, observe_target, sample_times
from jffsr.target.curved_covariance import _DRAWS, curved_estimate
from jffsr.target.estimate import NUM_ERRORS, corrected, error_of
from jffsr.target.filter import FilterSettings, filter_target
from jffsr.target.filter_steps import ProcessNoise
from jffsr.target.grasp_frames import fixed_frame
from jffsr.target.inertia_parameters import inertia_from_parameters
from jffsr.target.least_squares import fit_pass
from jffsr.target.prior import TargetPrior, draw_from_prior
from jffsr.target.tumbling import target_motion

CAMERA = Camera(dropouts=0.0, outliers=0.0)
INTERVAL = 1 / CAMERA.rate


def own_target(estimate) -> Target:
    """The target that an estimate describes, in the marker's axes."""
    none = jnp.zeros((0, 3)), jnp.zeros((0, 4))
    unturned = jnp.array([1.0, 0, 0, 0])
    inertia = inertia_from_parameters(estimate.inertia_parameters)
    return Target(jnp.ones(()), inertia, estimate.marker_offset_T, unturned, *none)


def poses_of(estimate, count: int) -> Measurements:
    """Its exact poses from now on, by the motion that keeps its series and shares no step with the filter."""
    target, times = own_target(estimate), sample_times(CAMERA, count)
    motion = target_motion(target, estimate.state, count * INTERVAL, count)

    def pose(time):
        return fixed_frame(motion(time), target.marker_position, target.marker_quaternion)[:2]

    return Measurements(times, *jax.vmap(pose)(times), jnp.ones(count, bool))


def differences(poses: Measurements, other: Measurements) -> np.ndarray:
    """Positions and attitudes (N, 6) of the one poses less the others."""
    turns = [Rotation.from_quat(np.asarray(p.quaternion), scalar_first=True) for p in (poses, other)]
    turned = (turns[1].inv() * turns[0]).as_rotvec()
    return np.concatenate([np.asarray(poses.position - other.position), turned], axis=1)


@pytest.mark.slow
def test_the_normal_equations_are_those_of_finite_differences():
    count, until = 30, 25
    prior = TargetPrior.create((0.1, -0.05, 0.2), inertia=(0.7, 0.9, 1.0))
    start = draw_from_prior(prior, jax.random.key(2))
    weights = np.array([1.0, 0.0, 0.5, 1.0, 1.0] * 6)
    exact = jax.jit(partial(poses_of, count=count))
    noise = np.diag([1e-4, 2e-4, 1e-4, 1e-3, 1e-3, 2e-3])
    shifted = exact(corrected(start, jnp.full(NUM_ERRORS, 1e-7)))
    run = jax.jit(
        lambda poses: fit_pass(
            start, poses, until, lambda k, _: jnp.asarray(weights)[k], INTERVAL, prior, noise, 8
        )
    )
    found = run(shifted)

    h = 1e-5
    moved = [[exact(corrected(start, sign * h * e)) for sign in (1, -1)] for e in np.eye(NUM_ERRORS)]
    rows = np.stack([differences(*pair) / (2 * h) for pair in moved], axis=-1)[:until]
    residual = differences(shifted, exact(start))[:until]
    scale = weights[:until, None, None] * np.linalg.inv(noise)
    residuals = [
        [np.asarray(prior.normalised_residual(corrected(start, sign * h * e))) for sign in (1, -1)]
        for e in np.eye(NUM_ERRORS)
    ]
    of_prior = np.stack([(b - a) / (2 * h) for a, b in residuals], axis=-1)
    matrix = np.einsum("kir,kij,kjs->rs", rows, scale, rows) + of_prior.T @ of_prior
    vector = np.einsum("kir,kij,kj->r", rows, scale, residual)
    vector = vector + of_prior.T @ np.asarray(prior.normalised_residual(start))
    size = np.sqrt(np.diag(matrix))
    np.testing.assert_allclose(found.matrix / size[:, None] / size, matrix / size[:, None] / size, atol=1e-7)
    np.testing.assert_allclose(found.vector / size, vector / size, atol=1e-6 * np.abs(vector / size).max())
    squares = np.einsum("ki,ij,kj->k", residual, np.linalg.inv(noise), residual)
    np.testing.assert_allclose(found.squared[:until], squares, rtol=1e-4)
    assert np.all(found.squared[until:] == 0)
    later = target_motion(own_target(start), start.state, 3.0, 30)(until * INTERVAL)
    np.testing.assert_allclose(found.end.position, later.position, atol=1e-12)
    np.testing.assert_allclose(found.end.angular_velocity_T, later.angular_velocity_T, atol=1e-12)


def test_draws_are_normal_numbers_with_their_opposites():
    half = len(_DRAWS) // 2
    assert np.array_equal(_DRAWS[:half], -_DRAWS[half:])
    across = _DRAWS[:half] @ _DRAWS[:half].T
    np.testing.assert_allclose(across - np.diag(np.diag(across)), 0, atol=1e-12)
    # Twenty squared lengths have a mean of 20 with a deviation of sqrt(40/20).
    assert abs(np.diag(across).mean() - 20) < 3 * np.sqrt(2)


def curved(poses, start, prior, camera, until):
    """Estimates with and without curvature, and the start of the fit, of poses that are all trusted."""
    noise, trusted = jnp.asarray(camera.covariance), jnp.ones(len(poses.time), bool)
    args = INTERVAL, prior, noise
    best = jax.lax.fori_loop(0, 5, lambda _, now: refit_start(poses, now, until, *args), start)
    found = fit_pass(best, poses, until, lambda k, _: 1.0, *args, 8)
    return found.estimate, curved_estimate(best, found, poses, until, trusted, *args), best


def refit_start(poses, start, until, interval, prior, noise):
    """One Gauss-Newton correction."""
    return corrected(
        start, fit_pass(start, poses, until, lambda k, _: 1.0, interval, prior, noise, 8).correction
    )


@pytest.mark.slow
def test_where_the_prior_knows_almost_all_nothing_is_curved():
    known = {f"{what}_deviation": 1e-3 for what in ("angular_velocity", "inertia", "velocity", "offset")}
    prior = TargetPrior.create((0.1, -0.05, 0.2), inertia=(0.7, 0.9, 1.0), **known)
    start = draw_from_prior(prior, jax.random.key(3))

    @jax.jit
    def run(key):
        target = own_target(start)
        states = jax.vmap(target_motion(target, start.state, 6.0, 60))(sample_times(CAMERA, 53))
        return curved(observe_target(target, states, CAMERA, key), start, prior, CAMERA, 53)

    plain, bent, _ = run(jax.random.key(4))
    root = np.linalg.cholesky(np.asarray(plain.covariance))
    added = np.linalg.solve(root, np.linalg.solve(root, np.asarray(bent.covariance - plain.covariance)).T)
    # The nodes stand for five poses each, and so weigh a draw by some parts in a thousand otherwise.
    assert np.all(np.abs(np.linalg.eigvalsh(added)) < 1e-2)
    assert np.linalg.norm(np.linalg.solve(root, np.asarray(error_of(plain, bent)))) < 0.1


@pytest.mark.slow
def test_the_curved_covariance_is_that_of_many_fits():
    """Poses with other noise, and priors with other means, fitted anew, spread as the covariance says."""
    count, runs = 300, 300
    prior = TargetPrior.create((0.05, -0.03, 0.06), inertia=(0.7, 0.9, 1.0), inertia_deviation=0.1)
    start = draw_from_prior(prior, jax.random.key(5))
    target = own_target(start)
    states = jax.vmap(target_motion(target, start.state, 31.0, 310))(sample_times(CAMERA, count))

    @jax.jit
    def once(key):
        return curved(observe_target(target, states, CAMERA, key), start, prior, CAMERA, count)

    plain, bent, best = once(jax.random.key(6))
    known = own_target(best)
    seen = jax.vmap(target_motion(known, best.state, 31.0, 310))(sample_times(CAMERA, count))
    noise = jnp.asarray(CAMERA.covariance)

    def again(key):
        of_camera, of_prior = jax.random.split(key)
        poses = observe_target(known, seen, CAMERA, of_camera)
        rate, inertia, velocity, offset = jnp.split(jax.random.normal(of_prior, (14,)), [3, 8, 11])
        other = TargetPrior(
            best.angular_velocity_T + prior.angular_velocity_deviation * rate,
            best.inertia_parameters + prior.inertia_deviation * inertia,
            best.velocity + prior.velocity_deviation * velocity,
            best.marker_offset_T + prior.offset_deviation * offset,
            prior.angular_velocity_deviation,
            prior.inertia_deviation,
            prior.velocity_deviation,
            prior.offset_deviation,
        )
        fitted = jax.lax.fori_loop(
            0, 6, lambda _, now: refit_start(poses, now, count, INTERVAL, other, noise), best
        )
        return error_of(
            plain, fit_pass(fitted, poses, count, lambda k, _: 1.0, INTERVAL, other, noise, 8).end
        )

    keys = jax.random.split(jax.random.key(7), runs)
    errors = np.asarray(jax.jit(lambda k: jax.lax.map(again, k, batch_size=50))(keys))
    root = np.linalg.cholesky(np.asarray(plain.covariance))
    spread = np.cov(np.linalg.solve(root, errors.T))
    told = np.linalg.solve(root, np.linalg.solve(root, np.asarray(bent.covariance)).T)
    values, vectors = np.linalg.eigh(told)
    found = np.einsum("ik,ij,jk->k", vectors, spread, vectors)
    # Four directions are wider than the derivatives say, by a factor of three together; the others are not.
    assert found[-4:].sum() > 8
    np.testing.assert_allclose(values[-4:].sum(), found[-4:].sum(), rtol=0.3)
    np.testing.assert_allclose(found[:-4].mean(), 1, atol=0.1)
    np.testing.assert_allclose(values[:-4].mean(), 1, atol=0.02)


@pytest.mark.slow
def test_with_process_noise_old_poses_are_not_fitted_anew():
    prior = TargetPrior.create((0.05, -0.03, 0.06), inertia=(0.7, 0.9, 1.0))
    start = draw_from_prior(prior, jax.random.key(8))
    target = own_target(start)
    states = jax.vmap(target_motion(target, start.state, 7.0, 70))(sample_times(CAMERA, 60))
    poses = observe_target(target, states, CAMERA, jax.random.key(9))

    def run(every, disturbance):
        settings = FilterSettings(20, process_noise=ProcessNoise(disturbance), refit_every=every)
        return jax.jit(lambda p: filter_target(p, CAMERA, prior, settings).estimate)(poses)

    few, many, free = run(10, 5e-3), run(40, 5e-3), run(10, 0.0)
    np.testing.assert_allclose(few.standard_deviation, many.standard_deviation, rtol=1e-12)
    assert np.all(
        np.asarray(few.standard_deviation)[-1, 3:6] > 1.05 * np.asarray(free.standard_deviation)[-1, 3:6]
    )
