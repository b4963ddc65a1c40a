"""Descents from several starts, inside the box, and the map into it."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from shifted_functions import LOWER, OPTIMUM, UPPER, rosenbrock, sphere

from jffsr.errors import InputError
from jffsr.optimizers.box import from_box, to_box
from jffsr.optimizers.driver import Phase, Stop, run
from jffsr.optimizers.gradient import ADAM, GradientDescent
from jffsr.optimizers.interface import FunctionProblem, Population
from jffsr.optimizers.minimize import minimize
from jffsr.optimizers.registry import Settings, build_phases

KEY = jax.random.key(4)
VALLEY = FunctionProblem(LOWER[:4], UPPER[:4], rosenbrock)
# No start but one finds the box's other valley by chance: the starts are near.
NEAR = Population(
    jnp.asarray(OPTIMUM[:4] + np.array([[-0.9, 0.6, -0.5, 0.8], [0.5, 0.4, -1.0, 0.2]])), jnp.full(2, jnp.inf)
)


def test_box_map_round_trip():
    rng = np.random.default_rng(1)
    inside = LOWER + (UPPER - LOWER) * rng.uniform(0.001, 0.999, (200, LOWER.size))
    back = to_box(from_box(inside, LOWER, UPPER), LOWER, UPPER)
    np.testing.assert_allclose(back, inside, rtol=0, atol=1e-13)


def test_box_map_stays_inside():
    free = np.concatenate([np.random.default_rng(2).normal(size=(500, LOWER.size)) * 50, np.zeros((1, 12))])
    free[0] = np.pi / 2
    free[1] = -np.pi / 2
    there = np.asarray(to_box(free, LOWER, UPPER))
    slack = 1e-15 * (UPPER - LOWER)
    assert np.all((there >= LOWER - slack) & (there <= UPPER + slack))


def test_box_map_leaves_the_bounds_and_keeps_an_empty_width():
    lower, upper = np.array([-1.0, 2.0, 5.0]), np.array([3.0, 2.0, 6.0])
    for corner in (lower, upper):
        free = from_box(corner, lower, upper)
        slope = jax.jacfwd(lambda z: to_box(z, lower, upper))(free)
        assert np.all(np.isfinite(slope))
        assert abs(slope[0, 0]) > 0.01
        assert to_box(free, lower, upper)[1] == 2.0


def test_lbfgs_finds_the_end_of_the_valley_and_stops():
    phase = Phase("descent", GradientDescent(starts=2), Stop(iterations=300.0))
    outcome = run([phase], VALLEY, KEY, population=NEAR, chunk=50)
    assert outcome.best_value < 1e-10
    assert outcome.reason == "converged"
    assert outcome.history[-1].iteration < 300
    np.testing.assert_allclose(outcome.best_position, OPTIMUM[:4], atol=1e-4)


def test_adam_decreases():
    descent = GradientDescent(method=ADAM, learning_rate=0.02, starts=2)
    outcome = run([Phase("descent", descent, Stop(iterations=200.0))], VALLEY, KEY, population=NEAR, chunk=50)
    first, last = outcome.history[1].best_value, outcome.best_value
    assert last < 0.05 * first


def test_gradient_evaluations_are_those_of_active_starts():
    """Each accepted or refused trial of a start that has not stopped costs one; a callback counts them."""
    seen = []

    @jax.custom_vjp
    def counted(x):
        return sphere(x)

    def forward(x):
        jax.debug.callback(lambda _: seen.append(1), x)
        return sphere(x), x

    counted.defvjp(forward, lambda x, g: (2 * g * (x - OPTIMUM[: x.shape[0]]),))
    descent = GradientDescent(starts=1)
    problem = FunctionProblem(LOWER[:3], UPPER[:3], counted)
    outcome = run([Phase("descent", descent, Stop(iterations=12.0))], problem, KEY, chunk=6)
    jax.effects_barrier()
    assert len(seen) == outcome.gradient_evaluations > 3
    assert outcome.evaluations == 0


@pytest.mark.parametrize("inside", [True, False])
def test_never_worse_than_its_starts(inside):
    """Also where the starts stand on the bounds, which the descent itself cannot touch."""
    corners = jnp.asarray(np.stack([LOWER[:4], UPPER[:4], OPTIMUM[:4] if inside else LOWER[:4]]))
    function = rosenbrock if inside else lambda x: jnp.sum(x)
    problem = FunctionProblem(LOWER[:4], UPPER[:4], function)
    values = jax.vmap(function)(corners)
    outcome = run(
        [Phase("descent", GradientDescent(starts=3, memory=4), Stop(iterations=5.0))],
        problem,
        KEY,
        population=Population(corners, values),
    )
    assert outcome.best_value <= np.min(values)
    kept = np.sort(np.asarray(values))
    assert np.all(outcome.population.values <= kept)
    assert np.all(np.isfinite(outcome.population.positions))


def test_hybrid_beats_the_swarm_at_the_same_charge():
    """In the median of three seeds, a gradient charged as five evaluations."""
    best = []
    for seed in range(3):
        both = minimize(rosenbrock, (LOWER, UPPER), "hybrid", 1000, key=seed)
        charged = both.evaluations + 5 * both.gradient_evaluations
        swarm = minimize(rosenbrock, (LOWER, UPPER), "qpso", charged, key=seed)
        best.append((both.best_value, swarm.best_value))
    both, swarm = np.median(best, axis=0)
    assert both < 0.2 * swarm


def test_start_that_is_not_finite_is_drawn_again():
    """The objective is NaN in all but a corner of the box; the descent starts anew until it stands there."""
    problem = FunctionProblem(LOWER[:2], UPPER[:2], lambda x: jnp.where(x[0] > 3.5, sphere(x), jnp.nan))
    descent = GradientDescent(starts=2, memory=4)
    start = Population(jnp.zeros((2, 2)), jnp.full(2, jnp.inf))
    outcome = run([Phase("descent", descent, Stop(iterations=60.0))], problem, KEY, population=start)
    assert np.isfinite(outcome.best_value)
    assert outcome.best_position[0] > 3.5


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (((LOWER, UPPER[:3]), "qpso", 100), "two vectors of one length"),
        ((([], []), "qpso", 100), "two vectors of one length"),
        (((UPPER, LOWER), "qpso", 100), "no lower bound above its upper bound"),
        ((([0.0, -np.inf], [1.0, 1.0]), "qpso", 100), "bounds must be finite"),
        ((([0.0, np.nan], [1.0, 1.0]), "qpso", 100), "bounds must be finite"),
        (((LOWER, UPPER), "qpos", 100), "optimizer 'qpos' is unknown; allowed are qpso, hybrid, gradient"),
        (((LOWER, UPPER), "qpso", 49), "49 evaluations are fewer than one generation of 50 particles"),
    ],
)
def test_minimize_refuses(arguments, sentence):
    with pytest.raises(InputError, match=sentence):
        minimize(sphere, *arguments)


def test_registry_refuses_an_unknown_method():
    with pytest.raises(InputError, match="method 'newton' is unknown; allowed are lbfgs, adam"):
        build_phases("gradient", replace(Settings(), method="newton"))
