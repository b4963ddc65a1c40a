"""The filter's start: the most probable motion for the first poses together, by Gauss-Newton.

A filter that starts at the first pose, knowing neither rate nor offset, takes the marker's circling for drift of the
centre of mass, as its covariance has no place for a product of two unknowns; it is then too sure of itself for good.
So the first poses are fitted all at once, nonlinearly, from the prior. Outliers are weighed down (Huber), then left
out.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jffsr.spatial.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_rotation_vector,
)
from jffsr.target.camera import Measurements
from jffsr.target.estimate import TargetEstimate, corrected
from jffsr.target.least_squares import FitPass, fit_pass
from jffsr.target.prior import TargetPrior
from jffsr.types import Array, Matrix, Scalar

_ROBUST, _GATED, _DONE = range(3)
_ROBUST_PASSES, _GATED_PASSES = 6, 3
_FEW = 30
# Square of the normalised residual, of six numbers, from which it counts less: 95 % lie below.
_HUBER = 12.59


def acquire(
    measurements: Measurements, interval: float, prior: TargetPrior, noise: Matrix, gate: float, order: int
) -> tuple[TargetEstimate, Array]:
    """The most probable estimate at the first of a few poses (W, ...) with noise of covariance (6, 6), and which of
    them (W,) it trusts.

    Disturbances of the target are neglected over so short a time. Poses whose normalised squared residual is beyond
    the gate are left out.
    """
    first = prior.at_pose(*_middle_pose(measurements), measurements.time[0])

    def one_pass(start: TargetEstimate, phase: Scalar, until: Scalar) -> FitPass:
        def weigh(_, squared: Array) -> Array:
            robust = jnp.minimum(1.0, jnp.sqrt(_HUBER / jnp.maximum(squared, _HUBER)))
            return jnp.where(phase == _ROBUST, robust, squared <= gate)

        return fit_pass(start, measurements, until, weigh, interval, prior, noise, order)

    def improve(start: TargetEstimate, stage: tuple[Array, Array]):
        found = one_pass(start, *stage)
        return corrected(start, jnp.where(stage[0] == _DONE, 0.0, found.correction)), found.squared

    # The last pass corrects nothing more: it tells the outliers.
    count = len(measurements.time)
    few = min(count, _FEW)
    stages = [(_ROBUST, few)] * _ROBUST_PASSES + [(_GATED, few)] * _GATED_PASSES
    while few < count:
        few = min(count, few + max(10, few // 2))
        stages += [(_GATED, few)] * (2 if few < count else 4)
    stages.append((_DONE, count))
    phases = tuple(jnp.array(column) for column in zip(*stages, strict=True))
    start, squared = jax.lax.scan(improve, first, phases)
    return start, squared[-1] <= gate


def _middle_pose(measurements: Measurements) -> tuple[Array, Array]:
    """Position (3,) and quaternion (4,) of that of the first poses which differs least from the
    others, so that it is no outlier."""
    few = min(len(measurements.time), 7)
    position, quaternion, seen = measurements.position[:few], measurements.quaternion[:few], measurements.seen

    def apart(q: Array, p: Array) -> Scalar:
        turn = quaternion_to_rotation_vector(quaternion_multiply(quaternion_conjugate(q)[None], quaternion))
        away = jnp.sqrt(jnp.sum(turn * turn, axis=-1)) + jnp.sqrt(jnp.sum((position - p) ** 2, axis=-1))
        return jnp.sum(jnp.where(seen[:few], away, 0.0))

    total = jnp.where(seen[:few], jax.vmap(apart)(quaternion, position), jnp.inf)
    # Where none of them was seen, the first one that was.
    chosen = jnp.where(jnp.any(seen[:few]), jnp.argmin(total), jnp.argmax(seen))
    return measurements.position[chosen], measurements.quaternion[chosen]
