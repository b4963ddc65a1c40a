"""Joints kept off the ends of their ranges while they hold the base still: a task in the reaction null space.

Near an end of its range a joint has a rate v that leads back, and a weight in W that is zero elsewhere. With rates
qd_0 that absorb the momentum, those are commanded that make (qd - v)' W (qd - v) + |qd - qd_0|^2 least among all that
absorb it:

    qd = qd_0 + K (v - qd_0),    K = (N W N + 1)^-1 N W,    N = 1 - A# A

What is added is in the null space of A, so that the base feels nothing of it. The gradient of a cost (Liegeois 1977)
would push with one strength, whatever pushes outwards; the weight takes the joint's part in the momentum away as well
and gives it to the others, as the weighted least norm does (Chan and Dubey 1995).
"""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp

from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Limits
from jffsr.tracking.redundancy import range_share
from jffsr.types import Array, Matrix, Vector


@register_dataclass
@dataclass(frozen=True)
class RangesKept:
    """Joints led away from the ends of their ranges; those without a range, or not near its end, are left alone.

    begin: the share of the way from the middle of the range to its end from where on a joint is led back, below 1;
    gain, 1/s: how fast, times the way beyond that place; weight: of a joint at the end or beyond, where 1 is that of
    the rates added.
    """

    begin: Array | float = 0.9
    gain: Array | float = 0.2
    weight: Array | float = 100.0

    def wanted(self, limits: Limits, joint_position: Vector) -> tuple[Vector, Vector]:
        """Rates (n,), rad/s or m/s, towards the middle, and their weights (n,), 1: both zero away from the ends."""
        share, half = range_share(limits, joint_position)
        beyond = jnp.maximum(jnp.abs(share) - self.begin, 0.0)
        near = jnp.minimum(beyond / (1 - self.begin), 1.0)
        return -self.gain * half * jnp.sign(share) * beyond, self.weight * near**2 * (3 - 2 * near)

    def correction(self, limits: Limits, joint_position: Vector, space: Matrix) -> tuple[Matrix, Vector]:
        """K (n, n) of this module's text for the null space's projector (n, n), and v (n,)."""
        rates, weight = self.wanted(limits, joint_position)
        weighted = space * weight
        # Projected once more, so that rounding in the solution does not reach the base.
        gain = space @ jnp.linalg.solve(weighted @ space + jnp.eye(weight.shape[0]), weighted)
        return gain, rates
