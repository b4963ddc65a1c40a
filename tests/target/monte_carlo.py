"""Random targets drawn from a prior, seen by a camera and filtered, many at once."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp

from jffsr.target.body import Target
from jffsr.target.camera import observe_target, sample_times
from jffsr.target.estimate import error_of, true_estimate
from jffsr.target.filter import filter_target
from jffsr.target.grasp_frames import fixed_frame
from jffsr.target.inertia_parameters import inertia_from_parameters
from jffsr.target.prediction import ConvergenceTolerances, convergence, prediction_error
from jffsr.target.prior import draw_from_prior
from jffsr.target.tumbling import target_motion

GRASP = (jnp.array([0.2, -0.1, 0.05]), jnp.array([0.5, 0.5, 0.5, 0.5]))


@partial(jax.jit, static_argnums=(0, 1, 3, 4, 5, 6, 8))
def simulate(camera, settings, prior, count, runs, horizon, every, first_seed, factor=1.0):
    """NEES, NIS, whether used, the last errors and deviations, and the predictions' errors and claims of many
    runs, with the seeds from the first one on; the tolerances of convergence are the standard ones times the factor."""
    usual = ConvergenceTolerances()
    tolerances = ConvergenceTolerances(*(factor * usual.sizes))

    def one(key):
        of_truth, of_camera = jax.random.split(key)
        drawn = draw_from_prior(prior, of_truth)
        target = Target(
            jnp.ones(()), inertia_from_parameters(drawn.inertia_parameters), drawn.marker_offset_T,
            jnp.array([1.0, 0, 0, 0]), jnp.zeros((0, 3)), jnp.zeros((0, 4)),
        )  # fmt: skip
        times = sample_times(camera, count)
        end = times[-1] + horizon
        motion = target_motion(target, drawn.state, end, 2 * int(count / camera.rate + horizon))
        states = jax.vmap(motion)(times)
        filtered = filter_target(observe_target(target, states, camera, of_camera), camera, prior, settings)
        estimate = filtered.estimate
        now = jax.vmap(motion)(times[settings.acquisition :])
        truth = jax.vmap(partial(true_estimate, target))(now)
        errors = jax.vmap(error_of)(estimate, truth)
        solved = jnp.linalg.solve(estimate.covariance, errors[..., None])[..., 0]
        nees = jnp.sum(errors * solved, axis=-1)
        some = jax.tree.map(lambda x: x[::every], estimate)
        declared, prediction = convergence(some, horizon, max(1, int(horizon)), GRASP, None, tolerances)

        def miss(predicted):
            frame = fixed_frame(motion(predicted.time), target.marker_position + GRASP[0], GRASP[1])
            return prediction_error(predicted, *frame)

        misses = jax.vmap(miss)(prediction)
        predicted_nees = jnp.sum(
            misses * jnp.linalg.solve(prediction.covariance, misses[..., None])[..., 0], axis=-1
        )
        return {
            "nees": nees,
            "nis": filtered.normalised_innovation_squared,
            "used": filtered.used,
            "lost": filtered.lost,
            "error": errors[::every],
            "deviation": some.standard_deviation,
            "declared": declared,
            "miss": misses,
            "predicted_nees": predicted_nees,
        }

    return jax.lax.map(one, jax.vmap(jax.random.key)(first_seed + jnp.arange(runs)), batch_size=min(runs, 25))
