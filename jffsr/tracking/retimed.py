"""A target that runs along its own way at another pace."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp

from jffsr.pytrees import register_dataclass
from jffsr.trajectories.cartesian.interface import ToolTarget
from jffsr.types import Array, Scalar


@register_dataclass
@dataclass(frozen=True, eq=False)
class Retimed:
    """The target, at other times of its own: linear between the samples.

    target: a callable of a time that is a pytree; own_time (K + 1,), s, not falling, the target's time at K + 1 evenly
    spaced samples of the duration, s.
    """

    target: Any
    own_time: Array
    duration: Array

    def __call__(self, time: Scalar) -> ToolTarget:
        """What is asked of the tool at a time, s; the twist jumps at samples, where the pace does."""
        intervals = self.own_time.shape[0] - 1
        step = self.duration / intervals
        k = jnp.clip(jnp.floor(time / step).astype(int), 0, intervals - 1)
        pace = (self.own_time[k + 1] - self.own_time[k]) / step
        found = self.target(self.own_time[k] + pace * (time - k * step))
        return ToolTarget(found.position, found.quaternion, pace * found.twist, pace**2 * found.acceleration)
