"""The fastest timing of a path under limits of rate and acceleration.

In x = (ds/dt)^2 and u = d2s/dt2, dx/ds = 2 u and a quantity y(s) has the acceleration y' u + y'' x: every limit is
linear in (x, u). Over a step of the grid u is constant. Backwards from the end, the largest x is found from which the
rest can be gone (a linear programme in two unknowns, solved by pairs of constraints); then forwards, the largest u
that stays below it is taken. The idea is that of Bobrow (1985), Shin and McKay (1985), and of Pham and Pham (TOPP-RA,
2018), who also hold the limits at both ends of each step, as is done here. Where a quantity turns back, the largest u
may cost the next step more than it gains: less than 1e-4 of the duration over 100 steps, against a linear programme
over the whole profile.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.errors import InputError
from jffsr.spatial.safe import peak, safe_sqrt
from jffsr.trajectories.cartesian.tabulated import Tabulated
from jffsr.types import Array, Scalar, Vector

_UNBOUNDED = 1e12  # (1/s)^2, in place of no bound on (ds/dt)^2
_NO_LEVER = 1e-12  # a quantity this much less moved by u than the most moved one does not bound it


def rate_bound(slopes: Array, rate_limits: Vector) -> Vector:
    """Largest ds/dt (k,) at which quantities of slopes (k, n) by s keep rate limits (n,); inf if none moves."""
    size = jnp.abs(slopes)
    moving = size > 0
    return _least(jnp.where(moving, rate_limits / jnp.where(moving, size, 1.0), jnp.inf))


def _least(x: Array) -> Array:
    """Smallest value along the last axis, by the maximum whose gradient is safe."""
    return -peak(-jnp.moveaxis(x, -1, 0))


def fastest_timing(
    places: Vector,
    largest_rate: Vector,
    slopes: Array | None = None,
    bends: Array | None = None,
    acceleration_limits: Vector | None = None,
    start_rate: float = 0.0,
    end_rate: float = 0.0,
) -> Tabulated:
    """The fastest timing over a grid of places (k,) of the path; may be traced, vmapped and differentiated.

    largest_rate (k,): the largest ds/dt, 1/s, at each place, such as `rate_bound` gives. slopes and bends (k, n), first
    and second derivatives by s of n quantities (joints), whose accelerations keep the limits (n,) at both ends of each
    step; without limits the rate may jump within one step. start_rate and end_rate, 1/s, are cut to what is possible.
    Limits hold at the grid's places; between them they are off by the second order of the step. Raises InputError for
    sizes that differ and, of numbers that are not traced, bounds and limits that are not positive.
    """
    places, largest_rate = jnp.asarray(places), jnp.asarray(largest_rate)
    slopes, bends, limits = _checked(places, largest_rate, slopes, bends, acceleration_limits)
    step = places[1:] - places[:-1]
    bounded = jnp.isfinite(largest_rate)
    ceiling = jnp.where(bounded, jnp.where(bounded, largest_rate, 1.0) ** 2, _UNBOUNDED)
    ceiling = ceiling.at[-1].min(end_rate**2)
    # |lever u + pull x| <= 1, x being that of the step's beginning: at its beginning, then at its end.
    slopes, bends = slopes / limits, bends / limits
    lever = jnp.concatenate([slopes[:-1], slopes[1:] + 2 * step[:, None] * bends[1:]], axis=1)
    pull = jnp.concatenate([bends[:-1], bends[1:]], axis=1)
    sign = jnp.where(lever < 0, -1.0, 1.0)
    lever, pull = sign * lever, sign * pull

    def backward(next_most: Scalar, row: tuple[Scalar, Scalar, Vector, Vector]) -> tuple[Scalar, Scalar]:
        step, ceiling, lever, pull = row
        most = _largest_start(ceiling, next_most, step, lever, pull)
        return most, most

    rows = (step, ceiling[:-1], lever, pull)
    _, most = jax.lax.scan(backward, ceiling[-1], rows, reverse=True)
    most = jnp.append(most, ceiling[-1])

    def forward(x: Scalar, row: tuple[Scalar, Scalar, Vector, Vector]) -> tuple[Scalar, Scalar]:
        step, next_most, lever, pull = row
        bounds = lever > _NO_LEVER * jnp.max(lever, initial=0.0)
        largest = jnp.where(bounds, (1 - pull * x) / jnp.where(bounds, lever, 1.0), _UNBOUNDED)
        x = jnp.clip(x + 2 * step * _least(jnp.append(largest, _UNBOUNDED)), 0.0, next_most)
        return x, x

    begin = jnp.minimum(jnp.asarray(start_rate, most.dtype) ** 2, most[0])
    _, rest = jax.lax.scan(forward, begin, (step, most[1:], lever, pull))
    return Tabulated(places, safe_sqrt(jnp.concatenate([begin[None], rest])))


def _largest_start(ceiling: Scalar, next_most: Scalar, step: Scalar, lever: Vector, pull: Vector) -> Scalar:
    """The largest x <= ceiling for which some u has low <= lever u + pull x <= 1 and ends between 0 and next_most.

    An upper bound i and a lower one j leave room for u where x (lever_j pull_i - lever_i pull_j) is at most
    lever_j high_i - lever_i low_j, which is never negative; so x = 0 always does.
    """
    lever, pull = jnp.append(lever, 2 * step), jnp.append(pull, 1.0)
    low = jnp.append(jnp.full(lever.shape[0] - 1, -1.0), 0.0)
    high = jnp.append(jnp.ones(lever.shape[0] - 1), next_most)
    slope = lever[None, :] * pull[:, None] - lever[:, None] * pull[None, :]
    room = lever[None, :] * high[:, None] - lever[:, None] * low[None, :]
    binding = slope > 0
    largest = jnp.where(binding, room / jnp.where(binding, slope, 1.0), jnp.inf)
    return jnp.minimum(ceiling, _least(largest.ravel()))


def _checked(
    places: Vector, largest_rate: Vector, slopes: Array | None, bends: Array | None, limits: Vector | None
) -> tuple[Array, Array, Array]:
    """Slopes, bends and limits as arrays, of no quantity where there are no limits."""
    count = places.shape[0] if places.ndim == 1 else 0
    if count < 2 or largest_rate.shape != places.shape:
        raise InputError(
            f"places and largest_rate have the shapes {places.shape} and {largest_rate.shape}; two equal rows of at "
            f"least 2 numbers are expected"
        )
    if (slopes is None) != (limits is None) or (bends is None) != (limits is None):
        raise InputError("slopes, bends and acceleration_limits are given together or not at all")
    _refuse(largest_rate[1:-1], "largest_rate on the way", limits is None)
    _refuse(largest_rate[:: count - 1], "largest_rate at an end", limits is None, or_zero=True)
    if limits is None:
        return jnp.zeros((count, 0)), jnp.zeros((count, 0)), jnp.zeros(0)
    slopes, bends, limits = jnp.asarray(slopes), jnp.asarray(bends), jnp.asarray(limits)
    if slopes.shape != (count, *limits.shape) or bends.shape != slopes.shape or limits.ndim != 1:
        raise InputError(
            f"slopes, bends and acceleration_limits have the shapes {slopes.shape}, {bends.shape} and "
            f"{limits.shape}; ({count}, n) twice and (n,) are expected"
        )
    _refuse(limits, "acceleration_limits", True)
    return slopes, bends, limits


def _refuse(values: Array, what: str, finite: bool, or_zero: bool = False) -> None:
    """InputError for a value that is not positive, or not finite where it must be; traced ones pass."""
    if isinstance(values, jax.core.Tracer):
        return
    for value in np.asarray(values):
        if not (value > 0 or (or_zero and value == 0)) or (finite and np.isinf(value)):
            wanted = f"{'not negative' if or_zero else 'positive'}{' and finite' if finite else ''}"
            raise InputError(f"{what} is {value:g}; it must be {wanted}")
