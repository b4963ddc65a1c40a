"""The sine-polynomial joint law of Li 2022, eqs. (46)-(54), corrected and in nondimensional form.

With s = t/T and D1, D2 half the range and the middle of a joint's limits,

    q(t) = D2 + D1 sin(p(s)),
    p(s) = u0 + (u1 - u0)(10 s^3 - 15 s^4 + 6 s^5) + 64 s^3 (s - 1)^3 (alpha + beta (2 s - 1)),

where u0 and u1 are the arcsines of the start and the goal. Position, zero rate and zero acceleration hold
at both ends, and the joint limits everywhere, whatever alpha and beta are. The printed coefficients
(52)-(54) carry a wrong sign and wrong powers and miss the goal by 30 (u1 - u0). In the paper's numbers
a = a6 T^6 and b = a7 T^7, 64 alpha = a + 3.5 b and 64 beta = b/2: alpha and beta are used because a and b
alone are nearly collinear.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import jax.numpy as jnp
import numpy as np

from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.spatial.trigonometry import sine_cosine
from jffsr.trajectories.checks import checked_duration, checked_duration_bounds
from jffsr.trajectories.interface import Boundary
from jffsr.types import Array, Scalar, Vector

# arcsin has an infinite slope at a limit; closer than this share of the half range counts as on it.
_ON_LIMIT = 1e-9


@register_dataclass
@dataclass(frozen=True, eq=False)
class SinePolynomial:
    """Rest-to-rest joint motion inside position limits, with two free numbers per joint.

    start, goal, lower, upper (n,), rad or m; duration scalar, s; coefficients (n, 2), the columns alpha and
    beta; box scalar, the half width of the box that a planner searches for each of them. duration_bounds
    (2,), s, makes the duration a further free number, the last; None leaves it fixed. Raises InputError
    (from `between`) where start or goal is not strictly inside finite limits: arcsin is singular there.
    """

    start: Array
    goal: Array
    lower: Array
    upper: Array
    duration: Array
    coefficients: Array
    box: Array = field(default_factory=lambda: np.array(np.pi))
    duration_bounds: Array | None = None

    @classmethod
    def between(
        cls,
        start: Sequence[float],
        goal: Sequence[float],
        lower: Sequence[float],
        upper: Sequence[float],
        duration: float,
        coefficients: Array | None = None,
        box: float = np.pi,
        duration_bounds: tuple[float, float] | None = None,
        joint_names: Sequence[str] | None = None,
    ) -> SinePolynomial:
        """A checked trajectory from host numbers; coefficients are zero unless given."""
        start, goal, lower, upper = (np.array(x, dtype=float) for x in (start, goal, lower, upper))
        names = joint_names or [f"joint {i}" for i in range(start.size)]
        for what, value in (("start", start), ("goal", goal), ("upper limit", upper)):
            if value.shape != lower.shape:
                raise InputError(f"{what} has {value.size} numbers; the robot has {lower.size} joints")
        for what, value in (("start", start), ("goal", goal)):
            for name, x, low, high in zip(names, value, lower, upper, strict=True):
                if not (np.isfinite(low) and np.isfinite(high)):
                    raise InputError(
                        f"{name}: the sine-polynomial law needs finite position limits, found [{low:g}, {high:g}]"
                    )
                if not low + _ON_LIMIT * (high - low) < x < high - _ON_LIMIT * (high - low):
                    place = "on" if low <= x <= high else "outside"
                    raise InputError(
                        f"{name}: {what} {x:.6g} lies {place} the position limits [{low:.6g}, {high:.6g}]; "
                        f"the sine-polynomial law needs it strictly inside"
                    )
        if coefficients is not None and jnp.shape(coefficients) != (start.size, 2):
            raise InputError(
                f"coefficients have the shape {jnp.shape(coefficients)}; ({start.size}, 2) is expected"
            )
        return cls(
            start=start,
            goal=goal,
            lower=lower,
            upper=upper,
            duration=checked_duration(duration),
            coefficients=np.zeros((start.size, 2)) if coefficients is None else coefficients,
            box=np.array(box, dtype=float),
            duration_bounds=checked_duration_bounds(duration_bounds),
        )

    def __call__(self, time: Scalar) -> tuple[Vector, Vector, Vector]:
        """Joint position, rate and acceleration, (n,) each, at a time in [0, duration]."""
        return self.on_grid(jnp.asarray(time))

    def on_grid(self, time: Array) -> tuple[Array, Array, Array]:
        """The same at times of any shape, which follows the joints': (n, ...) each."""

        def by_joint(x: Array) -> Array:
            return jnp.reshape(x, jnp.shape(x) + (1,) * time.ndim)

        half, middle = (self.upper - self.lower) / 2, (self.upper + self.lower) / 2
        u0 = by_joint(jnp.arcsin((self.start - middle) / half))
        u1 = by_joint(jnp.arcsin((self.goal - middle) / half))
        alpha, beta = by_joint(self.coefficients[:, 0]), by_joint(self.coefficients[:, 1])
        half, middle = by_joint(half), by_joint(middle)
        s = time / self.duration

        ramp = s**3 * (10 + s * (-15 + 6 * s))
        ramp_1 = 30 * s**2 * (s - 1) ** 2
        ramp_2 = 60 * s * (s - 1) * (2 * s - 1)
        # bump = 64 s^3 (s - 1)^3 and its derivatives in s, written with w = s (s - 1).
        w, w_1 = s * (s - 1), 2 * s - 1
        bump = 64 * w**3
        bump_1 = 192 * w**2 * w_1
        bump_2 = 384 * w * (w_1**2 + w)
        shape = alpha + beta * w_1

        p = u0 + (u1 - u0) * ramp + bump * shape
        p_1 = ((u1 - u0) * ramp_1 + bump_1 * shape + 2 * bump * beta) / self.duration
        p_2 = ((u1 - u0) * ramp_2 + bump_2 * shape + 4 * bump_1 * beta) / self.duration**2
        sine, cosine = sine_cosine(p)
        return (
            middle + half * sine,
            half * cosine * p_1,
            half * (cosine * p_2 - sine * p_1**2),
        )

    def boundary(self) -> tuple[Boundary, Boundary]:
        """What is asked for at both ends: the start and the goal, at rest."""
        zero = jnp.zeros_like(jnp.asarray(self.start))
        return Boundary(self.start, zero, zero), Boundary(self.goal, zero, zero)

    def free_bounds(self) -> tuple[Vector, Vector]:
        """Lower and upper bounds (2n,) or (2n + 1,) of the free numbers: alpha, beta, then the duration."""
        box = jnp.broadcast_to(self.box, (2 * self.start.shape[0],))
        if self.duration_bounds is None:
            return -box, box
        return (
            jnp.concatenate([-box, jnp.asarray(self.duration_bounds)[:1]]),
            jnp.concatenate([box, jnp.asarray(self.duration_bounds)[1:]]),
        )

    def with_free(self, free: Vector) -> SinePolynomial:
        """The trajectory of these free numbers: the n alphas, the n betas, then the duration if it is free."""
        n = self.start.shape[0]
        coefficients = jnp.stack([free[:n], free[n : 2 * n]], axis=1)
        duration = self.duration if self.duration_bounds is None else free[2 * n]
        return replace(self, coefficients=coefficients, duration=duration)
