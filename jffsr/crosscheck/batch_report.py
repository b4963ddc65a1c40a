"""What a cross-check of many robots found, for people and for JSON."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from jffsr.crosscheck.report import Tolerances
from jffsr.crosscheck.rows import finite_or_none

_ROWS = (
    ("attitude", "base attitude", "rad"),
    ("position", "base position", "m"),
    ("tracking", "joint tracking", "rad or m"),
)


@dataclass(frozen=True)
class BatchReport:
    """K robots in MJX against our motion: largest differences over the samples, one number a robot.

    duration and step, s; momentum, P in N s, then L in N m s; attitude (K,), rad (geodesic), and position
    (K,), m, of the base; tracking (K,), rad or m, over all steps and joints; compile_seconds and run_seconds
    of the one call for all robots.
    """

    robot: str
    duration: float
    step: float
    momentum: tuple[float, ...]
    tolerances: Tolerances
    attitude: np.ndarray
    position: np.ndarray
    tracking: np.ndarray
    compile_seconds: float
    run_seconds: float

    @property
    def count(self) -> int:
        """Number of robots, K."""
        return len(self.attitude)

    @property
    def kept(self) -> np.ndarray:
        """Boolean (K,): whether a robot keeps every tolerance; NaN keeps none."""
        rows = [getattr(self, what) <= getattr(self.tolerances, what) for what, _, _ in _ROWS]
        return np.all(rows, axis=0)

    @property
    def passed(self) -> bool:
        """Whether every robot keeps every tolerance."""
        return bool(np.all(self.kept))

    @property
    def robots_per_second(self) -> float:
        """Whole motions that the compiled call makes in a second."""
        return self.count / self.run_seconds

    def worst(self, what: str) -> tuple[int, float]:
        """Index of the robot with the largest attitude, position or tracking difference, and that difference.

        NaN counts as largest.
        """
        values = getattr(self, what)
        index = int(np.argmax(np.where(np.isnan(values), np.inf, values)))
        return index, float(values[index])

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        if self.passed:
            return (
                f"MJX reproduces the motion of {'the robot' if self.count == 1 else f'all {self.count} robots'}: base "
                f"attitude within {self.worst('attitude')[1]:.2g} rad, base position within "
                f"{self.worst('position')[1]:.2g} m."
            )
        reasons = []
        for what, title, unit in _ROWS:
            index, value = self.worst(what)
            limit = getattr(self.tolerances, what)
            if not value <= limit:
                reasons.append(f"{title} by {value:.2g} {unit} ({limit:g} allowed) for robot {index}")
        failed = self.count - int(np.sum(self.kept))
        return (
            f"The cross-check failed for {failed} of {self.count} robots in MJX with {1e3 * self.step:.4g} ms "
            f"steps, at worst in " + ", in ".join(reasons) + "."
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, lists and text, ready for JSON; a number that is not finite becomes None."""
        worst = {what: self.worst(what) for what, _, _ in _ROWS}
        return {
            "robot": self.robot,
            "count": self.count,
            "duration": self.duration,
            "step": self.step,
            "momentum": list(self.momentum),
            "tolerances": {item.name: getattr(self.tolerances, item.name) for item in fields(Tolerances)},
            "worst": {
                what: {"robot": index, "value": finite_or_none(x)} for what, (index, x) in worst.items()
            },
            **{what: [finite_or_none(float(x)) for x in getattr(self, what)] for what, _, _ in _ROWS},
            "compile_seconds": self.compile_seconds,
            "run_seconds": self.run_seconds,
            "robots_per_second": finite_or_none(self.robots_per_second),
            "passed": self.passed,
            "sentence": self.sentence,
        }

    def to_text(self) -> str:
        """A table with one row per quantity, the seconds, and the sentence below it."""
        rows = [("difference of", "unit", "median", "worst", "robot", "allowed")]
        for what, title, unit in _ROWS:
            index, value = self.worst(what)
            median = float(np.median(getattr(self, what)))
            allowed = getattr(self.tolerances, what)
            rows.append((title, unit, f"{median:.2e}", f"{value:.2e}", f"{index}", f"{allowed:g}"))
        widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
        lines = []
        for row in rows:
            words = [text.ljust(width) for text, width in zip(row[:2], widths, strict=False)]
            numbers = [text.rjust(width) for text, width in zip(row[2:], widths[2:], strict=True)]
            lines.append("  ".join([*words, *numbers]))
        lines.append(
            f"{self.count} robots, {self.duration:g} s in steps of {1e3 * self.step:.4g} ms: compiled in "
            f"{self.compile_seconds:.1f} s, run in {self.run_seconds:.1f} s, {self.robots_per_second:.3g} robots a "
            f"second"
        )
        return "\n".join([*lines, self.sentence])
