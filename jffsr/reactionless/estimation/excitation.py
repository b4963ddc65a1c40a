"""Persistent excitation: what the null space is moved by while there is something to learn."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp

from jffsr.pytrees import register_dataclass
from jffsr.types import Array, Scalar, Vector

_GOLDEN = 0.6180339887498949


@register_dataclass
@dataclass(frozen=True, eq=False)
class SineSum:
    """zeta_j(t) = amplitude sum_k sin(2 pi f_jk t + phase_jk)/K: frequency and phase (n, K), Hz and rad; amplitude,
    rad/s."""

    amplitude: Array | float
    frequency: Array
    phase: Array

    @classmethod
    def spread(
        cls,
        num_joints: int,
        amplitude: Array | float = 0.1,
        slowest: float = 0.02,
        fastest: float = 0.15,
        terms: int = 3,
    ) -> SineSum:
        """So many terms a joint, no two with the same frequency, between the slowest and the fastest, Hz."""
        place = jnp.arange(num_joints * terms).reshape(terms, num_joints).T
        share = (place + 0.5) / (num_joints * terms)
        phase = 2 * jnp.pi * jnp.mod(_GOLDEN * place, 1.0)
        return cls(amplitude, slowest * (fastest / slowest) ** share, phase)

    def __call__(self, time: Scalar) -> Vector:
        """zeta (n,), rad/s, at a time, s."""
        return self.amplitude * jnp.mean(jnp.sin(2 * jnp.pi * self.frequency * time + self.phase), axis=-1)
