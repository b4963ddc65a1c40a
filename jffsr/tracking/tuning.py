"""The best numbers of a tracker for a path, as a problem for any optimizer of the family."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import jax.numpy as jnp
import numpy as np

from jffsr.dynamics.base_mode import FLOATING
from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.reading.did_you_mean import hint
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.tracking.indices import PathError, PublishedIndex
from jffsr.tracking.tracked import Tracked
from jffsr.tracking.tracker import Tracker
from jffsr.tracking.tracking import Target, samples, track
from jffsr.types import Array, Scalar, Vector

TUNABLE = ("lambda_max", "epsilon", "damping", "threshold", "position_gain", "attitude_gain")
"""Numbers of a tracker that can be searched for."""


@register_dataclass
@dataclass(frozen=True, eq=False)
class TuningProblem:
    """Choose named numbers of `tracker` so that the index of the tracked path is least.

    lower and upper (d,) bound the candidates, which are the numbers themselves or, where logarithmic says so (static,
    one a name), their natural logarithms. names are static. Everything else as in `track`; the index has value and
    smooth of a `Tracked`. Made by `tuning`, which checks it.
    """

    robot: Robot
    target: Any
    initial_state: State
    tracker: Tracker
    index: PublishedIndex | PathError
    lower: Array
    upper: Array
    momentum: Array
    duration: Array | float
    names: tuple[str, ...] = field(metadata={"static": True})
    logarithmic: tuple[bool, ...] = field(metadata={"static": True})
    num_samples: int = field(metadata={"static": True})
    end_effector: str | None = field(default=None, metadata={"static": True})
    base_mode: str = field(default=FLOATING, metadata={"static": True})

    def bounds(self) -> tuple[Vector, Vector]:
        """Lower and upper bounds (d,) of the candidates."""
        return self.lower, self.upper

    def tuned(self, candidate: Vector) -> Tracker:
        """The tracker with the numbers of a candidate (d,)."""
        numbers = {
            name: jnp.exp(candidate[k]) if self.logarithmic[k] else candidate[k]
            for k, name in enumerate(self.names)
        }
        return replace(self.tracker, **numbers)

    def tracked(self, candidate: Vector) -> Tracked:
        """The tracked motion of a candidate (d,)."""
        return track(
            self.robot,
            self.target,
            self.initial_state,
            self.tuned(candidate),
            self.duration,
            self.momentum,
            self.end_effector,
            self.base_mode,
            self.num_samples,
        )

    def value(self, candidate: Vector) -> Scalar:
        """The index."""
        return self.index.value(self.tracked(candidate))

    def smooth_and_value(self, candidate: Vector, looseness: Scalar | float = 1.0) -> tuple[Scalar, Scalar]:
        """The smooth index and the index itself, of the same motion."""
        tracked = self.tracked(candidate)
        return self.index.smooth(tracked, looseness), self.index.value(tracked)


def tuning(
    robot: Robot,
    target: Target,
    initial_state: State,
    tracker: Tracker,
    index: PublishedIndex | PathError,
    bounds: Mapping[str, tuple[float, float]],
    momentum: Array | None = None,
    duration: float | None = None,
    end_effector: str | None = None,
    base_mode: str = FLOATING,
) -> TuningProblem:
    """The problem of tuning the numbers named in bounds, each between its lower and upper bound.

    Where both bounds are positive the logarithm is searched. target must be a pytree (as `ToolTrajectory` is), with a
    duration of its own where none is given. Raises InputError for a name that is not tunable, and for bounds that are
    not finite, not in order or negative.
    """
    if not bounds:
        raise InputError(f"no number was named to be tuned; allowed are {', '.join(TUNABLE)}")
    for name, pair in bounds.items():
        if name not in TUNABLE:
            raise InputError(
                f"'{name}' is no number of a tracker; allowed are {', '.join(TUNABLE)}{hint(name, TUNABLE)}"
            )
        lower, upper = pair
        if not (np.isfinite(lower) and np.isfinite(upper) and 0 <= lower < upper):
            raise InputError(
                f"bounds of {name} are [{lower:g}, {upper:g}]; they must be finite, not negative and in order"
            )
    names = tuple(bounds)
    table = np.array([bounds[name] for name in names], dtype=float)
    logarithmic = table[:, 0] > 0
    table = np.where(logarithmic[:, None], np.log(np.where(table > 0, table, 1.0)), table)
    duration = float(target.duration) if duration is None else float(duration)
    return TuningProblem(
        robot=robot,
        target=target,
        initial_state=initial_state,
        tracker=tracker,
        index=index,
        lower=table[:, 0],
        upper=table[:, 1],
        momentum=np.zeros(6) if momentum is None else np.asarray(momentum, dtype=float),
        duration=duration,
        names=names,
        logarithmic=tuple(bool(x) for x in logarithmic),
        num_samples=samples(duration, tracker.period),
        end_effector=end_effector,
        base_mode=base_mode,
    )
