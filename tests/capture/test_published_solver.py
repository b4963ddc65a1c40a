"""The published solver: its measure, inertia and repair by hand, its archive, and a capture that it finds."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from planar_captures import START, planar_capture

from jffsr.capture.published_solver import (
    TOLERANCE,
    MatchProblem,
    RepairingSwarm,
    published_match,
    published_solver,
)
from jffsr.errors import InputError
from jffsr.optimizers.interface import FunctionProblem
from jffsr.optimizers.population import PopulationState


@pytest.fixture(scope="module")
def problem():
    return planar_capture(24)[0]


def test_the_measure_is_one_where_a_single_error_is_at_its_tolerance():
    """100 for each m, m/s and rad/s; sin of half the angle over sin of one degree."""
    error = np.zeros(12)
    for place in (1, 7, 11):
        single = np.where(np.arange(12) == place, 0.01, 0.0)
        np.testing.assert_allclose(published_match(single), 1.0, rtol=1e-12)
    error[3:6] = np.deg2rad(2.0) * np.array([0.6, 0.0, -0.8])
    np.testing.assert_allclose(published_match(error), 1.0, rtol=1e-12)
    error[0], error[6:9] = 0.02, [0.03, 0.0, 0.04]
    np.testing.assert_allclose(published_match(error), np.hypot(2.0, 1.0) + 5.0, rtol=1e-12)
    assert np.all(np.isfinite(jax.grad(published_match)(jnp.full(12, 1e-3))))


def test_inertia_follows_the_share_of_successes():
    swarm = RepairingSwarm(10.0, rule="success", inertia_start=0.9, inertia_end=0.4)
    found = [float(swarm.coefficients(3, share)[0]) for share in (0.0, 0.25, 1.0)]
    np.testing.assert_allclose(found, [0.4, 0.525, 0.9], rtol=1e-12)


def test_repair_leaves_candidates_within_the_limits_and_those_that_were(problem):
    rng = np.random.default_rng(2)
    limits = problem.robot.limits
    posed = MatchProblem(problem)
    repaired = jax.jit(jax.vmap(posed.repaired))
    wild = repaired(rng.uniform(-6.0, 6.0, (20, 12)))
    low, high = problem.bounds()
    assert np.all((wild >= low) & (wild <= high))
    times = np.linspace(0.0, 20.0, 400)
    peaks = []
    for free in wild:
        _, rate, second = problem.trajectory.with_free(free).on_grid(jnp.asarray(times))
        shares = (
            np.max(np.abs(rate), axis=1) / limits.velocity,
            np.max(np.abs(second), axis=1) / limits.acceleration,
        )
        peaks.append(np.max(shares, axis=0))
    # No more than a limit, and no less than is needed; between the samples the repair looks at, next to nothing.
    assert np.max(peaks) <= 1.005
    assert np.median(peaks) >= 0.99
    np.testing.assert_allclose(repaired(wild), wild, atol=1e-9)
    gentle = (START + rng.uniform(-0.02, 0.02, (5, 4, 3))).reshape(5, 12)
    np.testing.assert_allclose(repaired(gentle), gentle, atol=1e-14)


def test_the_archive_takes_the_best_that_may_be_within_the_tolerance():
    swarm = RepairingSwarm(10.0, particles=4, rule="success", archive=3)
    box = FunctionProblem(-np.ones(1), np.ones(1), lambda x: x[0])
    state = swarm.init(jax.random.key(0), box)
    assert np.all(np.isinf(state.own[3]))
    state = replace(state, position=jnp.array([[0.1], [0.2], [0.3], [0.4]]))
    kept, kept_value, own = swarm.keep(state, jnp.array([3.0, 100.0, 2.0, jnp.inf]))
    np.testing.assert_array_equal(own[3], [2.0, 3.0, np.inf])
    np.testing.assert_array_equal(own[2][:2], [[0.3], [0.1]])
    later = PopulationState(state.key, state.position + 1, kept, kept_value, own, state.progress)
    _, _, own = swarm.keep(later, jnp.array([1.0, 2.5, 4.0, 2.2]))
    np.testing.assert_array_equal(own[3], [1.0, 2.0, 2.2])
    np.testing.assert_allclose(own[2], [[1.1], [0.3], [1.4]], rtol=1e-12)


@pytest.mark.slow
def test_a_capture_of_the_planar_arm_is_found_and_chosen_from(problem):
    (found,) = published_solver([problem], generations=200, particles=30, archive=8)
    assert found.evaluations == 200 * 30
    assert len(found.free) > 0
    assert np.all(np.abs(found.error) <= TOLERANCE)
    assert found.disturbance[found.chosen["least_base_disturbance"]] == found.disturbance.min()
    assert found.manipulability[found.chosen["least_lost_manipulability"]] == found.manipulability.max()
    low, high = problem.bounds()
    assert np.all((found.free >= low) & (found.free <= high))


def test_a_free_grasp_time_is_refused(problem):
    free = replace(problem.trajectory, duration_bounds=np.array([15.0, 25.0]))
    with pytest.raises(InputError, match="leave duration_bounds out"):
        published_solver([replace(problem, trajectory=free)])
