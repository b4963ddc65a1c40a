"""The constraint that bodies keep clear of each other over a motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.clearance.along_motion import clearances
from jffsr.clearance.model import ClearanceModel
from jffsr.clearance.reports import NearestApproach, nearest_approach
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.rollouts.motion import Motion
from jffsr.spatial.safe import smooth_max
from jffsr.types import Array

MISS = 0.1
"""Clearance, m, whose lack counts as 1."""


class _Poses(NamedTuple):
    base_position: Array
    base_quaternion: Array
    joint_position: Array


@register_dataclass
@dataclass(frozen=True, eq=False)
class Clearance:
    """Every pair of bodies of `model` stays `margin`, m, apart at all samples of the motion.

    A model with a target needs `target`: a pytree that is called with a time, s, and gives what has position (3,), m,
    and quaternion (4,), T to I, such as a TargetMotion; the motion's time zero is its time `begin`. Or states at the
    motion's own samples, (N + 1, ...) each. The smallest distance over time is rounded off downwards over `width`, m,
    so that the margin is kept a little early, by width log(N + 1) at most. Overruns count per 0.1 m, so that the
    tolerance is 0.1 mm.

    windows, static: the motion is parted into so many windows of samples, and only the sample of each at which some
    pair comes nearest counts, and is differentiated: a planner that asks for many derivatives is then some five
    times as fast. None counts every sample.
    """

    model: ClearanceModel
    margin: Array | float = 0.02
    target: Callable[[Array], Any] | Any | None = None
    begin: Array | float = 0.0
    width: Array | float = 1e-3
    tolerance: Array | float = 1e-3
    windows: int | None = field(default=None, metadata={"static": True})
    name: str = field(default="clearance", metadata={"static": True})
    unit, per = "m", MISS

    def equality(self, robot: Robot, motion: Motion) -> Array:
        """None."""
        return jnp.zeros(0)

    def inequality(self, robot: Robot, motion: Motion) -> Array:
        """How far each pair comes within the margin, (p,), per 0.1 m."""
        states = self._target_states(motion)
        poses = _Poses(motion.base_position, motion.base_quaternion, motion.joint_position)
        if self.windows is not None:
            nearest = self._nearest(robot, poses, states)
            poses, states = jax.tree.map(lambda x: jnp.asarray(x)[nearest], (poses, states))
        distances = clearances(self.model, robot, poses, states)
        return (jnp.asarray(self.margin) + smooth_max(-jnp.asarray(distances), self.width, axis=1)) / MISS

    def distances(self, robot: Robot, motion: Motion) -> Array:
        """Signed distances of all pairs at the motion's samples, (p, N + 1), m; of a known motion on the host."""
        return clearances(self.model, robot, motion, self._target_states(motion))

    def nearest(self, robot: Robot, motion: Motion) -> NearestApproach:
        """Which pair comes nearest in a motion that is known, how near and when; host only."""
        return nearest_approach(self.model, robot, motion, self._target_states(motion))

    def _target_states(self, motion: Motion) -> Any:
        states = self.target
        return jax.vmap(states)(motion.time + self.begin) if callable(states) else states

    def _nearest(self, robot: Robot, poses: _Poses, states: Any) -> Array:
        """The sample of each window, (windows,), at which the nearest pair is nearest."""
        fixed = jax.lax.stop_gradient((self.model, robot, poses, states))
        least = jnp.min(clearances(*fixed), axis=0)
        count = least.shape[0]
        bounds = np.linspace(0, count, min(self.windows, count) + 1).astype(int)
        return jnp.stack([a + jnp.argmin(least[a:b]) for a, b in pairwise(bounds)])
