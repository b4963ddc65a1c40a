"""A joint path through samples of position, rate and acceleration: what a manoeuvre is followed by."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from jffsr.pytrees import register_dataclass
from jffsr.types import Array, Scalar, Vector

# Columns: powers of s, 0 to 5, for unit position, rate and acceleration at the start of a step, then at its end.
_QUINTIC = np.array(
    [
        [1, 0, 0, -10, 15, -6],
        [0, 1, 0, -6, 8, -3],
        [0, 0, 0.5, -1.5, 1.5, -0.5],
        [0, 0, 0, 10, -15, 6],
        [0, 0, 0, -4, 7, -3],
        [0, 0, 0, 0.5, -1, 0.5],
    ]
)


@register_dataclass
@dataclass(frozen=True, eq=False)
class SampledPath:
    """Quintic pieces through joint positions, rates and accelerations (N + 1, n) at equal steps of duration/N, s.

    Between samples it errs by the sixth power of the step. Outside [0, duration] it stands at its ends.
    """

    joint_position: Array
    joint_velocity: Array
    joint_acceleration: Array
    duration: Scalar

    def __call__(self, time: Scalar) -> tuple[Vector, Vector, Vector]:
        """Position, rate and acceleration (n,) each at a time, s."""
        steps = self.joint_position.shape[0] - 1
        h = self.duration / steps
        samples = [
            jnp.asarray(x) for x in (self.joint_position, self.joint_velocity, self.joint_acceleration)
        ]
        place = jnp.clip(time / h, 0.0, steps)
        k = jnp.clip(jnp.floor(place).astype(int), 0, steps - 1)
        s = place - k
        ends = [jnp.stack([x[k] * h**power, x[k + 1] * h**power]) for power, x in enumerate(samples)]
        values = jnp.concatenate([jnp.stack([x[0] for x in ends]), jnp.stack([x[1] for x in ends])])
        coefficients = _QUINTIC.T @ values
        powers = jnp.arange(6)
        one = s**powers
        first = jnp.where(powers > 0, powers * s ** jnp.maximum(powers - 1, 0), 0.0)
        second = jnp.where(powers > 1, powers * (powers - 1) * s ** jnp.maximum(powers - 2, 0), 0.0)
        inside = (time >= 0) & (time <= self.duration)
        return (
            one @ coefficients,
            jnp.where(inside, first @ coefficients / h, 0.0),
            jnp.where(inside, second @ coefficients / h**2, 0.0),
        )
