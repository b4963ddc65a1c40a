"""What a check of a tracked motion in MuJoCo found, for people and for JSON."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from jffsr.crosscheck.rows import aligned, finite_or_none

FORCES, MOMENTUM = "forces", "momentum"
TITLES = {FORCES: "torques and impulses", MOMENTUM: "momentum equation"}

# Below this share of a tolerance the tracked motion's own error and rounding decide, not MuJoCo's step.
_FLOOR = 1e-2


@dataclass(frozen=True)
class TrackedTolerances:
    """Largest differences that pass: attitudes, rad; positions, m; joints, rad or m; momentum, relative.

    forces is for the motion under torques and impulses, whose steps are MuJoCo's; momentum for the momentum equation.
    """

    forces: float = 1e-6
    momentum: float = 1e-6
    tracking: float = 1e-6
    conservation: float = 1e-8


@dataclass(frozen=True)
class TrackedComparison:
    """One way of making the motion in MuJoCo against the tracked one, maxima over the samples.

    way: 'forces' or 'momentum'; step, s, of the forces, else None; attitude, rad, and position, m, of the base;
    tool_attitude and tool_position of the tool; tracking, rad or m, of the joints; momentum_linear and
    momentum_angular, distance from the given momentum relative to the largest of any one body; run_seconds.
    """

    way: str
    step: float | None
    attitude: float
    position: float
    tool_attitude: float
    tool_position: float
    tracking: float
    momentum_linear: float
    momentum_angular: float
    run_seconds: float

    @property
    def pose(self) -> dict[str, float]:
        """The four differences of poses by what they are of."""
        return {
            "base attitude": self.attitude,
            "base position": self.position,
            "tool attitude": self.tool_attitude,
            "tool position": self.tool_position,
        }

    def exceeded(self, tolerances: TrackedTolerances) -> list[str]:
        """A phrase for each tolerance that is not kept; NaN keeps none."""
        limit = tolerances.forces if self.way == FORCES else tolerances.momentum
        found = [
            f"the {what} differs by {value:.2g} {'rad' if 'attitude' in what else 'm'} ({limit:g} allowed)"
            for what, value in self.pose.items()
            if not value <= limit
        ]
        if not self.tracking <= tolerances.tracking:
            found.append(f"the joints miss by {self.tracking:.2g} rad or m ({tolerances.tracking:g} allowed)")
        drift = np.maximum(self.momentum_linear, self.momentum_angular)
        if not drift <= tolerances.conservation:
            found.append(f"momentum is off by {drift:.2g} relative ({tolerances.conservation:g} allowed)")
        return found


@dataclass(frozen=True)
class TrackedCheck:
    """Every way and step, the coarsest step first, and the verdict at the finest."""

    robot: str
    duration: float
    momentum: tuple[float, ...]
    tolerances: TrackedTolerances
    comparisons: tuple[TrackedComparison, ...]

    def of_way(self, way: str) -> tuple[TrackedComparison, ...]:
        """The comparisons of 'forces' or 'momentum', coarsest step first."""
        return tuple(entry for entry in self.comparisons if entry.way == way)

    def failures(self) -> list[str]:
        """A clause for each way that fails: tolerances at its finest step, then growth with the step.

        A difference under a hundredth of its tolerance may do as it likes when the step shrinks.
        """
        found = []
        for way in TITLES:
            first, last = self.of_way(way)[0], self.of_way(way)[-1]
            reasons = last.exceeded(self.tolerances)
            for what, fine in last.pose.items():
                small = fine <= _FLOOR * self.tolerances.forces
                if not reasons and first is not last and not (small or fine < first.pose[what]):
                    reasons.append(f"the difference in {what} does not shrink with the step")
            if reasons:
                found.append(f"by the {TITLES[way]} " + ", ".join(reasons))
        return found

    @property
    def passed(self) -> bool:
        """Whether both ways keep every tolerance and the differences shrink with the step."""
        return not self.failures()

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        failures = self.failures()
        if failures:
            return "MuJoCo contradicts the tracked motion: " + "; ".join(failures) + "."
        finest = [self.of_way(way)[-1].pose for way in TITLES]
        largest = {what: max(pose[what] for pose in finest) for what in finest[0]}
        return (
            f"MuJoCo reproduces the tracked motion by torques and by its momentum: base within "
            f"{largest['base attitude']:.2g} rad and {largest['base position']:.2g} m, tool within "
            f"{largest['tool attitude']:.2g} rad and {largest['tool position']:.2g} m."
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, lists and text, ready for JSON; a number that is not finite becomes None."""
        rows = [
            {item.name: finite_or_none(getattr(entry, item.name)) for item in fields(entry)}
            for entry in self.comparisons
        ]
        return {
            "robot": self.robot,
            "duration": self.duration,
            "momentum": list(self.momentum),
            "tolerances": {
                item.name: getattr(self.tolerances, item.name) for item in fields(TrackedTolerances)
            },
            "comparisons": rows,
            "passed": self.passed,
            "sentence": self.sentence,
        }

    def to_text(self) -> str:
        """A table with one row per way and step, and the sentence below it."""
        rows = [
            ("MuJoCo, by", "step", "base", "base", "tool", "tool", "joints", "P", "L", "run"),
            ("", "ms", "rad", "m", "rad", "m", "rad or m", "relative", "relative", "s"),
        ]
        for entry in self.comparisons:
            numbers = (*entry.pose.values(), entry.tracking, entry.momentum_linear, entry.momentum_angular)
            step = "" if entry.step is None else f"{1e3 * entry.step:.4g}"
            rows.append((TITLES[entry.way], step, *(f"{x:.2e}" for x in numbers), f"{entry.run_seconds:.1f}"))
        return "\n".join([*aligned(rows), self.sentence])
