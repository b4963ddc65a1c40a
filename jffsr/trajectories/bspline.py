"""Clamped B-spline joint motion: Wang, Luo and Yu 2021, eqs. (28)-(32), corrected.

With s = t/T in [0, 1], C(s) = sum_i P_i N_(i,p)(s) of degree p over knots whose first and last p + 1 are 0 and 1,
uniform between. Each basis function lives on u_i <= s < u_(i+1), the last span closed. The derivatives are
B-splines of lower degree over the same knots,

    C' = sum_j L_j N_(j+1,p-1),   L_j = p (P_(j+1) - P_j)/(u_(j+p+1) - u_(j+1)),
    C'' = sum_j M_j N_(j+2,p-2),  M_j = (p - 1)(L_(j+1) - L_j)/(u_(j+p+1) - u_(j+2)),

where (31) as printed is damaged. Three equal control points at an end are rest there: zero rate, zero acceleration.
A spline lies in the hull of its control points, so that control points inside position limits keep them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import jax.numpy as jnp
import numpy as np

from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.trajectories.checks import (
    checked_box,
    checked_duration,
    checked_duration_bounds,
    checked_size,
    joint_vectors,
)
from jffsr.trajectories.interface import Boundary
from jffsr.trajectories.polynomial import DEFAULT_BOX
from jffsr.types import Array, Scalar, Vector

_REST = 3  # control points that a state of rest at an end takes
_LEAST_DEGREE = 3  # below, the acceleration jumps inside the motion
_PER_SPAN = 32


@register_dataclass
@dataclass(frozen=True, eq=False)
class ClampedBSpline:
    """Joint motion from rest or under way, to rest at a goal or to wherever the free control points lead.

    start (n,), rad or m; goal (n,), or None, which leaves the end free; lower and upper (n,), the position limits,
    infinite where there is none; duration scalar, s; inner (f, n), the control points that are not fixed by an end;
    box scalar, the half width of the box of each about the straight way from start to goal (about the start without a
    goal), cut at the position limits. degree is static. duration_bounds (2,), s, makes the duration a further free
    number, the last. start_rate and start_acceleration (n,), None for rest: the second and third control points follow
    from them, and may lie beyond the position limits. Raises InputError (from `between`) for sizes that differ, a start
    or goal outside the limits, a degree below 3, too few control points, or a duration or box that is not positive.
    """

    start: Array
    goal: Array | None
    lower: Array
    upper: Array
    duration: Array
    inner: Array
    box: Array = field(default_factory=lambda: np.array(DEFAULT_BOX))
    duration_bounds: Array | None = None
    start_rate: Array | None = None
    start_acceleration: Array | None = None
    degree: int = field(default=4, metadata={"static": True})

    @classmethod
    def between(
        cls,
        start: Sequence[float],
        goal: Sequence[float] | None,
        duration: float,
        degree: int = 4,
        control_points: int = 8,
        lower: Sequence[float] | float = -np.inf,
        upper: Sequence[float] | float = np.inf,
        inner: Array | None = None,
        box: float = DEFAULT_BOX,
        duration_bounds: tuple[float, float] | None = None,
        joint_names: Sequence[str] | None = None,
        start_rate: Array | None = None,
        start_acceleration: Array | None = None,
    ) -> ClampedBSpline:
        """A checked trajectory from host numbers; control_points counts the fixed ones too.

        Unless `inner` is given the control points lie evenly on the straight way from start to goal.
        """
        ends = joint_vectors(start=start, goal=start if goal is None else goal, lower=lower, upper=upper)
        names = joint_names or [f"joint {i}" for i in range(ends["start"].size)]
        for what in ("start", "goal"):
            for name, x, low, high in zip(names, ends[what], ends["lower"], ends["upper"], strict=True):
                if not low <= x <= high:
                    raise InputError(
                        f"{name}: {what} {x:.6g} lies outside the position limits [{low:.6g}, {high:.6g}]"
                    )
        degree = checked_size(degree, _LEAST_DEGREE, "degree")
        fixed = _REST if goal is None else 2 * _REST
        count = checked_size(control_points, max(degree + 1, fixed), "control_points")
        shape = (count - fixed, ends["start"].size)
        if inner is not None and jnp.shape(inner) != shape:
            raise InputError(f"inner control points have the shape {jnp.shape(inner)}; {shape} is expected")
        law = cls(
            start=ends["start"],
            goal=None if goal is None else ends["goal"],
            lower=ends["lower"],
            upper=ends["upper"],
            duration=checked_duration(duration),
            inner=np.zeros(shape) if inner is None else inner,
            box=checked_box(box),
            duration_bounds=checked_duration_bounds(duration_bounds),
            degree=degree,
            **_under_way(ends["start"], start_rate, start_acceleration),
        )
        return law if inner is not None else replace(law, inner=np.asarray(law._straight()))

    @property
    def control_points(self) -> Array:
        """All control points (K, n), those that the ends fix included."""
        parts = [self._beginning(), jnp.asarray(self.inner)]
        if self.goal is not None:
            parts.append(jnp.tile(self.goal, (_REST, 1)))
        return jnp.concatenate(parts)

    @property
    def knots(self) -> np.ndarray:
        """Knots (K + degree + 1,) in [0, 1], the first and the last degree + 1 of them equal."""
        count = self.inner.shape[0] + (_REST if self.goal is None else 2 * _REST)
        inside = np.linspace(0, 1, count - self.degree + 1)
        return np.concatenate([np.zeros(self.degree), inside, np.ones(self.degree)])

    def __call__(self, time: Scalar) -> tuple[Vector, Vector, Vector]:
        """Joint position, rate and acceleration, (n,) each, at a time in [0, duration]."""
        return self.on_grid(jnp.asarray(time))

    def on_grid(self, time: Array) -> tuple[Array, Array, Array]:
        """The same at times of any shape, which follows the joints': (n, ...) each."""
        position, slope, bend = self._curve(time / self.duration)
        return position, slope / self.duration, bend / self.duration**2

    def _curve(self, s: Array) -> tuple[Array, Array, Array]:
        """C, C' and C'' in s, (n, ...) each."""
        knots, p = self.knots, self.degree
        points = self.control_points
        last = points.shape[0]
        slopes = _differences(points, p, knots, 1)
        bends = _differences(slopes, p - 1, knots, 2)
        *_, low, middle, high = basis(knots, p, s)
        return (
            jnp.tensordot(points.T, high, 1),
            jnp.tensordot(slopes.T, middle[1:last], 1),
            jnp.tensordot(bends.T, low[2:last], 1),
        )

    def least_duration(self, velocity: Array, acceleration: Array) -> Scalar:
        """Least duration, s, at which this path keeps the limits (n,) of rate and acceleration, eq. (32).

        The largest of |C'|/velocity and sqrt(|C''|/acceleration) over joints and a fine grid of 32 points a span.
        """
        inside = self.knots[self.degree : -self.degree]
        s = np.linspace(0, 1, _PER_SPAN * (inside.size - 1) + 1)
        _, slope, bend = self._curve(jnp.asarray(s))
        peak_slope, peak_bend = jnp.max(jnp.abs(slope), axis=1), jnp.max(jnp.abs(bend), axis=1)
        return jnp.maximum(jnp.max(peak_slope / velocity), jnp.sqrt(jnp.max(peak_bend / acceleration)))

    def boundary(self) -> tuple[Boundary, Boundary]:
        """What is asked for at both ends: rest at the start, and rest at the goal or nothing."""
        zero = jnp.zeros_like(jnp.asarray(self.start))
        end = Boundary(None, None, None) if self.goal is None else Boundary(self.goal, zero, zero)
        if self.start_rate is None:
            return Boundary(self.start, zero, zero), end
        return Boundary(self.start, self.start_rate, self.start_acceleration), end

    def free_bounds(self) -> tuple[Vector, Vector]:
        """Lower and upper bounds of the free numbers: the inner control points one after another, then the duration."""
        middle = self._straight()
        low = jnp.maximum(middle - self.box, self.lower).ravel()
        high = jnp.minimum(middle + self.box, self.upper).ravel()
        if self.duration_bounds is None:
            return low, high
        bounds = jnp.asarray(self.duration_bounds)
        return jnp.concatenate([low, bounds[:1]]), jnp.concatenate([high, bounds[1:]])

    def with_free(self, free: Vector) -> ClampedBSpline:
        """The trajectory of these free numbers, in the order of `free_bounds`."""
        shape = self.inner.shape
        size = shape[0] * shape[1]
        duration = self.duration if self.duration_bounds is None else free[size]
        return replace(self, inner=jnp.reshape(free[:size], shape), duration=duration)

    def _beginning(self) -> Array:
        """The first three control points (3, n): those of position, rate and acceleration at the start."""
        if self.start_rate is None:
            return jnp.tile(self.start, (_REST, 1))
        knots, p = self.knots, self.degree
        first, second = knots[p + 1], knots[p + 2]
        slope = self.start_rate * self.duration
        bend = self.start_acceleration * self.duration**2
        after = self.start + first / p * slope
        third = after + second / p * (slope + first / (p - 1) * bend)
        return jnp.stack([jnp.asarray(self.start), after, third])

    def _straight(self) -> Array:
        """Inner control points (f, n) evenly on the way from start to goal, or at the start."""
        count = self.inner.shape[0]
        share = np.arange(1, count + 1)[:, None] / (count + 1)
        change = 0.0 if self.goal is None else self.goal - self.start
        return self.start + share * change


def _under_way(start: np.ndarray, rate: Array | None, acceleration: Array | None) -> dict[str, Array]:
    """The fields of a start that is not at rest; one of both that is missing is zero."""
    if rate is None and acceleration is None:
        return {}
    zero = np.zeros_like(start)
    given = {
        "start_rate": zero if rate is None else rate,
        "start_acceleration": zero if acceleration is None else acceleration,
    }
    for name, value in given.items():
        if np.shape(value) != start.shape:
            raise InputError(f"{name} has the shape {np.shape(value)}; {start.shape} is expected")
    return given


def _differences(points: Array, degree: int, knots: np.ndarray, first: int) -> Array:
    """Control points (k - 1, n) of the derivative of a spline of that degree over knots[first - 1:]."""
    count = points.shape[0] - 1
    span = knots[first + degree : first + degree + count] - knots[first : first + count]
    return degree * (points[1:] - points[:-1]) / span[:, None]


def basis(knots: np.ndarray | Array, degree: int, s: Array) -> list[Array]:
    """Basis functions of all degrees up to `degree`, (len(knots) - 1 - d, ...) each: Cox and de Boor's recursion.

    Of clamped knots, NumPy's or traced, whose first and last span are not empty, at s of any shape. Outside [0, 1],
    which rounding may reach, the first and the last piece go on.
    """
    xp = np if isinstance(knots, np.ndarray) else jnp

    def by_place(x: np.ndarray | Array) -> np.ndarray | Array:
        return x.reshape(x.shape + (1,) * s.ndim)

    inside = knots[degree + 1 : knots.shape[0] - degree - 1]
    empty, most = np.full(degree, np.inf), np.full(1, np.inf)
    begin = by_place(xp.concatenate([empty, -most, inside, empty]))
    end = by_place(xp.concatenate([-empty, inside, most, -empty]))
    functions = [((begin <= s) & (s < end)).astype(s.dtype)]
    for d in range(1, degree + 1):
        span = knots[d:] - knots[:-d]
        # A function over knots that all coincide is zero, and so is its share.
        inverse = xp.where(span > 0, 1 / xp.where(span > 0, span, 1.0), 0.0)
        before = functions[-1]
        rising = (s - by_place(knots[: -d - 1])) * by_place(inverse[:-1]) * before[:-1]
        falling = (by_place(knots[d + 1 :]) - s) * by_place(inverse[1:]) * before[1:]
        functions.append(rising + falling)
    return functions
