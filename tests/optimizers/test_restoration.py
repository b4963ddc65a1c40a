"""Levenberg-Marquardt back to where constraints are kept: published constraints, bounds, numbers that are none."""

from __future__ import annotations

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from constrained_functions import G06, G11, HS71

from jffsr.optimizers.constraints import ConstrainedFunctions
from jffsr.optimizers.interface import Population
from jffsr.optimizers.restoration import Restoration, damped_step

STEPS = 40


def run(problem, method, population=None, key=0):
    """The state after STEPS steps, and how many of them each start took."""

    @jax.jit
    def search():
        state = method.init(jax.random.key(key), problem, population)

        def step(state, _):
            return method.step(problem, state), jnp.sum(state.trials.active)

        return jax.lax.scan(step, state, length=STEPS)

    return jax.device_get(search())


def posed(published, tolerance=1e-10):
    return ConstrainedFunctions(
        published.lower,
        published.upper,
        tolerance,
        published.function,
        published.equality,
        published.inequality,
    )


@pytest.mark.parametrize("published", [G06, G11, HS71], ids=["g06", "g11", "hs71"])
def test_every_start_that_ends_well_keeps_the_published_constraints(published):
    problem, method = posed(published), Restoration(starts=6)
    state, active = run(problem, method)
    kept = state.trials.kept
    assert kept.mean() >= 0.5
    for point in state.trials.point[kept]:
        assert np.all((point >= published.lower) & (point <= published.upper))
        if published.equality is not None:
            assert np.max(np.abs(published.equality(point))) <= 1e-10
        if published.inequality is not None:
            assert np.max(published.inequality(point)) <= 0
    # Counted is what was evaluated: one derivative for each start still under way.
    assert int(state.progress.gradient_evaluations) == active.sum()
    assert int(state.progress.evaluations) == 0


def test_convergence_is_quadratic_near_a_solution():
    """Three circles' worth of equalities: from nearby the residual's exponent about doubles with each step."""
    problem = ConstrainedFunctions(
        np.full(3, -2.0),
        np.full(3, 2.0),
        1e-12,
        lambda x: x[0],
        equality=lambda x: jnp.array([x @ x - 1, x[0] * x[1] - 0.2, x[2] - x[0] ** 2]),
    )
    population = Population(np.array([[0.9, 0.2, 0.8]]), np.array([np.inf]))
    state, active = run(problem, Restoration(starts=1), population)
    assert state.trials.kept[0]
    assert active.sum() <= 12
    assert np.max(np.abs(problem.equality(state.trials.point[0]))) < 1e-12


def test_a_number_at_its_bound_stays_there_and_the_others_go_on():
    problem = ConstrainedFunctions(
        np.zeros(2), np.ones(2), 1e-10, lambda x: x[0], equality=lambda x: x[:1] + 3 * x[1:] - 3.5
    )
    state, _ = run(problem, Restoration(starts=1), Population(np.array([[1.0, 0.1]]), np.array([np.inf])))
    assert state.trials.kept[0]
    np.testing.assert_allclose(state.trials.point[0] @ [1.0, 3.0], 3.5, atol=1e-10)
    assert np.all((state.trials.point >= 0) & (state.trials.point <= 1))


def test_where_constraints_contradict_it_ends_and_says_so():
    problem = ConstrainedFunctions(
        -np.ones(2), np.ones(2), 1e-10, lambda x: x[0], equality=lambda x: jnp.array([x[0] - 0.5, x[0] + 0.5])
    )
    state, active = run(problem, Restoration(starts=2))
    assert not state.trials.kept.any()
    assert active[-1] == 0
    # The least-squares point between the two.
    np.testing.assert_allclose(state.trials.point[:, 0], 0.0, atol=1e-6)


def test_numbers_that_are_none_never_win_and_their_start_is_drawn_again():
    problem = ConstrainedFunctions(
        -np.ones(2),
        np.ones(2),
        1e-10,
        lambda x: x[0],
        equality=lambda x: jnp.where(x[:1] > 0, jnp.sqrt(x[:1]), jnp.nan) - 0.7 + 0 * x[1:],
    )
    population = Population(np.array([[-0.5, 0.0], [-0.9, 0.3]]), np.full(2, np.inf))
    state, _ = run(problem, Restoration(starts=2), population)
    chex.assert_tree_all_finite(state.trials.point)
    assert state.trials.kept.all()
    np.testing.assert_allclose(state.trials.point[:, 0], 0.49, atol=1e-9)
    assert np.isfinite(state.progress.best_value)


def test_the_damped_step_is_the_one_of_the_normal_equations():
    """Without damping and bounds, NumPy's least squares."""
    rng = np.random.default_rng(0)
    jacobian, residual = rng.normal(size=(9, 4)), rng.normal(size=9)
    wide = np.full(4, 10.0)
    step = damped_step(jacobian, residual, 1e-16, np.zeros(4), -wide, wide)
    np.testing.assert_allclose(step, np.linalg.lstsq(jacobian, -residual, rcond=None)[0], atol=1e-10)
