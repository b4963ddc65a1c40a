"""Polynomial joint motion of a chosen degree: Hu, Wang and Shi 2011, eq. (8), with exact ends.

With s = t/T and w = 2 s - 1,

    q(t) = h(s) + 64 s^3 (1 - s)^3 sum_k c_k w^k / m_k,    k = 0 ... degree - 6,

where h is the one polynomial of degree 5 that meets position, rate and acceleration at both ends. The six lower
coefficients of (8) are thereby eliminated, and as many numbers are left per joint as the degree exceeds 5. c_0 is the
deviation from h at s = 1/2, the others are higher moments; m_k is the peak of (1 - w^2)^3 |w|^k, so that each c_k
is the largest deviation, rad or m, that its own part makes.

Unlike the sine-polynomial law this one does not keep position limits by itself: an index that is to keep them
needs the term `JointPosition`.
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
from jffsr.types import Array, Scalar, Vector

DEFAULT_BOX = 2.0
_ENDS = 5  # the degree that position, rate and acceleration at both ends take up

# Columns: h's powers of s, 0 to 5, for unit position, rate and acceleration at the start, then at the end.
_HERMITE = np.array(
    [
        [1, 0, 0, -10, 15, -6],
        [0, 1, 0, -6, 8, -3],
        [0, 0, 0.5, -1.5, 1.5, -0.5],
        [0, 0, 0, 10, -15, 6],
        [0, 0, 0, -4, 7, -3],
        [0, 0, 0, 0.5, -1, 0.5],
    ]
).T


@register_dataclass
@dataclass(frozen=True, eq=False)
class Polynomial:
    """Joint motion between given states, with `degree` - 5 free numbers per joint.

    start, goal, start_rate, goal_rate, start_acceleration, goal_acceleration (n,), rad or m and s; duration scalar, s;
    coefficients (n, degree - 5), rad or m; box scalar, the half width of the box that a planner searches for each of
    them. duration_bounds (2,), s, makes the duration a further free number, the last. Raises InputError (from
    `between`) for sizes that differ, a degree below 5, or a duration or box that is not positive.
    """

    start: Array
    goal: Array
    start_rate: Array
    goal_rate: Array
    start_acceleration: Array
    goal_acceleration: Array
    duration: Array
    coefficients: Array
    box: Array = field(default_factory=lambda: np.array(DEFAULT_BOX))
    duration_bounds: Array | None = None

    @classmethod
    def between(
        cls,
        start: Sequence[float],
        goal: Sequence[float],
        duration: float,
        degree: int = 7,
        start_rate: Sequence[float] | None = None,
        goal_rate: Sequence[float] | None = None,
        start_acceleration: Sequence[float] | None = None,
        goal_acceleration: Sequence[float] | None = None,
        coefficients: Array | None = None,
        box: float = DEFAULT_BOX,
        duration_bounds: tuple[float, float] | None = None,
    ) -> Polynomial:
        """A checked trajectory from host numbers: at rest at both ends and without deviation unless given."""
        ends = joint_vectors(
            start=start,
            goal=goal,
            start_rate=start_rate,
            goal_rate=goal_rate,
            start_acceleration=start_acceleration,
            goal_acceleration=goal_acceleration,
        )
        shape = (ends["start"].size, checked_size(degree, _ENDS, "degree") - _ENDS)
        if coefficients is not None and jnp.shape(coefficients) != shape:
            raise InputError(f"coefficients have the shape {jnp.shape(coefficients)}; {shape} is expected")
        return cls(
            **ends,
            duration=checked_duration(duration),
            coefficients=np.zeros(shape) if coefficients is None else coefficients,
            box=checked_box(box),
            duration_bounds=checked_duration_bounds(duration_bounds),
        )

    @property
    def degree(self) -> int:
        """The polynomial's degree."""
        return self.coefficients.shape[1] + _ENDS

    def __call__(self, time: Scalar) -> tuple[Vector, Vector, Vector]:
        """Joint position, rate and acceleration, (n,) each, at a time in [0, duration]."""
        return self.on_grid(jnp.asarray(time))

    def on_grid(self, time: Array) -> tuple[Array, Array, Array]:
        """The same at times of any shape, which follows the joints': (n, ...) each."""

        def by_joint(x: Array) -> Array:
            return jnp.reshape(x, jnp.shape(x) + (1,) * time.ndim)

        duration, s = self.duration, time / self.duration
        ends = jnp.stack(
            [
                self.start,
                self.start_rate * duration,
                self.start_acceleration * duration**2,
                self.goal,
                self.goal_rate * duration,
                self.goal_acceleration * duration**2,
            ]
        )
        base = _powers(by_joint(_HERMITE @ ends), s)
        # The bump v^3, v = 4 s (1 - s), and the shape on it; both with their first two derivatives in s.
        v, w = 4 * s * (1 - s), 2 * s - 1
        bump = (v**3, -12 * v**2 * w, 96 * v * w**2 - 24 * v**2)
        scaled = self.coefficients / _peaks(self.degree - _ENDS)
        p, p_w, p_ww = _powers(by_joint(jnp.asarray(scaled).T), w)
        shape = (p, 2 * p_w, 4 * p_ww)
        position = base[0] + bump[0] * shape[0]
        rate = base[1] + bump[1] * shape[0] + bump[0] * shape[1]
        acceleration = base[2] + bump[2] * shape[0] + 2 * bump[1] * shape[1] + bump[0] * shape[2]
        return position, rate / duration, acceleration / duration**2

    def boundary(self) -> tuple[Boundary, Boundary]:
        """What is asked for at both ends."""
        return (
            Boundary(self.start, self.start_rate, self.start_acceleration),
            Boundary(self.goal, self.goal_rate, self.goal_acceleration),
        )

    def free_bounds(self) -> tuple[Vector, Vector]:
        """Lower and upper bounds of the free numbers: c_0 of all joints, c_1 of all, ..., then the duration."""
        box = jnp.broadcast_to(self.box, (self.coefficients.size,))
        if self.duration_bounds is None:
            return -box, box
        bounds = jnp.asarray(self.duration_bounds)
        return jnp.concatenate([-box, bounds[:1]]), jnp.concatenate([box, bounds[1:]])

    def with_free(self, free: Vector) -> Polynomial:
        """The trajectory of these free numbers, in the order of `free_bounds`."""
        joints, count = self.coefficients.shape
        coefficients = jnp.reshape(free[: joints * count], (count, joints)).T
        duration = self.duration if self.duration_bounds is None else free[joints * count]
        return replace(self, coefficients=coefficients, duration=duration)


def _peaks(count: int) -> np.ndarray:
    """Peak (count,) of (1 - w^2)^3 |w|^k on [-1, 1] for k = 0, 1, ...: at w^2 = k/(k + 6)."""
    k = np.arange(count)
    return (6 / (k + 6)) ** 3 * (k / (k + 6.0)) ** (k / 2)


def _powers(coefficients: Array, x: Array) -> tuple[Array, Array, Array]:
    """The polynomials of coefficients (degree + 1, ...), lowest first, and two derivatives, by Horner's rule."""
    zero = jnp.zeros(jnp.broadcast_shapes(coefficients.shape[1:], x.shape))
    value, slope, half_bend = zero, zero, zero
    for c in coefficients[::-1]:
        half_bend = half_bend * x + slope
        slope = slope * x + value
        value = value * x + c
    return value, slope, 2 * half_bend
