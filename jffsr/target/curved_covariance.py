"""Mean and covariance of what many poses leave open, where the equations between poses and unknowns are curved.

The most probable motion and its normal equations are right as far as the poses go: the squared distance of the truth
from it, measured in poses, is chi-square with twenty degrees of freedom. But rate, inertia and offset hang together by
curved relations, each many times thinner than it is long, so that in these numbers a covariance from derivatives alone
is too small across them. So the moments are those of a sample: for each of some draws of the measurements' error, the
motion that it would give, with the derivatives of the most probable motion (J. M. Bardsley, A. Solonen, H. Haario and
M. Laine, "Randomize-then-optimize", 2014). Only what bends away from the derivatives is taken from the sample.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.pytrees import register_dataclass
from jffsr.target.camera import Measurements
from jffsr.target.estimate import NUM_ERRORS, TargetEstimate, corrected, error_of
from jffsr.target.filter_steps import MEASURED, advance, innovation
from jffsr.target.least_squares import FitPass
from jffsr.target.prior import TargetPrior
from jffsr.types import Array, Matrix, Scalar

# Poses whose time one node stands for.
_TOGETHER = 5
_ITERATIONS = 3
# Order of the Taylor series between nodes: a turn of 0.25 rad leaves 2e-10, one of 0.1 rad rounding alone.
_ORDER = 11


def _draws() -> np.ndarray:
    """Draws (40, 20) of twenty independent normal numbers, each with its opposite; directions at right angles."""
    rng = np.random.default_rng(0)
    directions = np.linalg.qr(rng.standard_normal((NUM_ERRORS, NUM_ERRORS)))[0]
    half = np.sqrt(rng.chisquare(NUM_ERRORS, (NUM_ERRORS, 1))) * directions
    return np.concatenate([half, -half])


_DRAWS = _draws()


def curved_estimate(
    best: TargetEstimate,
    found: FitPass,
    poses: Measurements,
    until: Scalar,
    trusted: Array,
    interval: float,
    prior: TargetPrior,
    noise: Matrix,
) -> TargetEstimate:
    """The mean and the covariance, one interval after the first `until` poses, of the motions that they allow.

    best is the most probable estimate at the first pose and found the last pass from it; trusted (N,) says which
    poses count.
    """
    nodes = _Nodes.along(best, poses, until, trusted, interval, noise)
    to_end, to_start = nodes.transition
    covariance = jnp.linalg.inv(to_start.T @ found.matrix @ to_start)
    covariance = (covariance + covariance.T) / 2
    precision = jnp.linalg.inv(covariance)
    prior_residual, prior_rows = prior.normalised_residual(best), prior.derivative(best) @ to_start

    def misfit(drawn: Array, error: Array) -> tuple[Array, Scalar, TargetEstimate]:
        """What an error lacks of the drawn one as the poses tell errors by the best motion's derivatives, (20,); its
        normalised square; and the end of the motion."""
        (end, start), vector = nodes.compare(corrected(nodes.middle, error))
        vector = vector + prior_rows.T @ (prior_residual - prior.normalised_residual(start))
        missing = drawn - covariance @ vector
        return missing, missing @ precision @ missing, end

    def bend(drawn: Array) -> Array:
        def improve(carry, _):
            error, missing, size, _ = carry
            tried = error + missing
            there = misfit(drawn, tried)
            return jax.tree.map(lambda a, b: jnp.where(there[1] < size, a, b), (tried, *there), carry), None

        # The first of them tries what the derivatives say.
        unmoved = (jnp.zeros(NUM_ERRORS), drawn, jnp.array(jnp.inf), found.end)
        (*_, end), _ = jax.lax.scan(improve, unmoved, length=1 + _ITERATIONS)
        return error_of(found.end, end) - to_end @ drawn

    bent = jax.vmap(bend)(_DRAWS @ jnp.linalg.cholesky(covariance).T)
    mean = jnp.mean(bent, axis=0)
    added = (bent - mean).T @ (bent - mean) / len(bent)
    estimate = found.estimate
    return replace(corrected(estimate, mean), covariance=estimate.covariance + added)


@register_dataclass
@dataclass(frozen=True, eq=False)
class _Nodes:
    """Instants at which other motions are compared with the best one, later and earlier than the middle of all poses.

    There what the poses tell is least bent. middle: the best motion's estimate there; position (K + 1, 2, 3) and
    quaternion (K + 1, 2, 4), its poses at the nodes, outwards on both sides, and then at the end and at the first pose;
    weight (K + 1, 2, 20, 6), what a difference counts in the normal equations of errors at the middle; transition
    (2, 20, 20) of these to the end and to the first pose; durations (K + 1, 2), s, from each node to the next;
    `count` () nodes are in use on each side, at most K.
    """

    middle: TargetEstimate
    position: Array
    quaternion: Array
    weight: Array
    transition: Array
    durations: Array
    count: Array

    @classmethod
    def along(
        cls,
        best: TargetEstimate,
        poses: Measurements,
        until: Scalar,
        trusted: Array,
        interval: float,
        noise: Matrix,
    ) -> _Nodes:
        """The nodes along the best motion, each of which counts the trusted poses nearest to it."""
        num = -(-len(poses.time) // (2 * _TOGETHER))
        count = -(-until // (2 * _TOGETHER))
        step = until * interval / (2 * count)
        index, node = jnp.arange(len(poses.time)), jnp.arange(num + 1)
        twice = 2 * index + 1 - until
        place = jnp.where(index < until, jnp.abs(twice) * count // until, num + 1)
        number = jnp.zeros((num + 1, 2)).at[place, (twice < 0).astype(int)].add(trusted, mode="drop")
        precision = jnp.linalg.inv(noise)

        def to_middle(k, now):
            return advance(now, jnp.where(k == 0, -interval / 2, step), _ORDER)[0]

        middle = jax.lax.fori_loop(0, count + 1, to_middle, best)
        # The end lies one interval after the last pose.
        later = jnp.where(node == 0, step / 2, jnp.where(node == count, (step + interval) / 2, step))
        earlier = jnp.where(node == 0, step / 2, jnp.where(node == count, (step - interval) / 2, step))
        durations = jnp.stack([later, -earlier], axis=1)

        def follow(k, carry):
            now, transition, position, quaternion, weight = carry
            now, by_step = _advance_both(now, durations[k])
            transition = by_step @ transition
            rows = jnp.swapaxes(MEASURED @ transition, -1, -2)
            return (
                now,
                transition,
                position.at[k].set(now.marker_position),
                quaternion.at[k].set(now.quaternion),
                weight.at[k].set(number[k][:, None, None] * rows @ precision),
            )

        empty = [jnp.zeros((num + 1, 2, *shape)) for shape in ((3,), (4,), (NUM_ERRORS, 6))]
        still = jnp.broadcast_to(jnp.eye(NUM_ERRORS), (2, NUM_ERRORS, NUM_ERRORS))
        out = jax.lax.fori_loop(0, count + 1, follow, (_twice(middle), still, *empty))
        _, transition, position, quaternion, weight = out
        return cls(middle, position, quaternion, weight, transition, durations, count)

    def compare(self, other: TargetEstimate) -> tuple[tuple[TargetEstimate, TargetEstimate], Array]:
        """The end and the start of another motion, from its estimate at the middle, and what its differences at the
        nodes add up to on the right side (20,) of the normal equations."""

        def follow(k, carry):
            now, vector = carry
            now, _ = _advance_both(now, self.durations[k])
            away = jax.vmap(innovation)(now, self.position[k], self.quaternion[k])
            return now, vector - jnp.einsum("sij,sj->i", self.weight[k], away)

        start = (_twice(other), jnp.zeros(NUM_ERRORS))
        ends, vector = jax.lax.fori_loop(0, self.count + 1, follow, start)
        return tuple(jax.tree.map(lambda x, side=side: x[side], ends) for side in (0, 1)), vector


def _twice(estimate: TargetEstimate) -> TargetEstimate:
    return jax.tree.map(lambda x: jnp.stack([x, x]), estimate)


def _advance_both(estimates: TargetEstimate, durations: Array) -> tuple[TargetEstimate, Array]:
    return jax.vmap(lambda estimate, duration: advance(estimate, duration, _ORDER))(estimates, durations)
