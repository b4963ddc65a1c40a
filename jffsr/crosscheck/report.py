"""What a cross-check found, for people and for JSON."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from jffsr.crosscheck.rows import aligned, finite_or_none

ENGINE_TITLES = {"mujoco": "MuJoCo", "mjx": "MJX"}

# Below this share of a tolerance the reference's own error and rounding decide, not the engine's step.
_FLOOR = 1e-2


@dataclass(frozen=True)
class Tolerances:
    """Largest differences that pass: base attitude, rad; base position, m; joint tracking, rad or m."""

    attitude: float = 1e-4
    position: float = 1e-4
    tracking: float = 1e-6


@dataclass(frozen=True)
class Comparison:
    """One engine at one step length against the reference, maxima over the samples.

    step, s; attitude, rad (geodesic); position, m; tracking, rad or m (over all steps); momentum_linear,
    N s, and momentum_angular, N m s, distance from the given momentum; the same relative to the largest
    momentum that any one body has (0 where nothing moves); seconds to compile and to run.
    """

    engine: str
    step: float
    attitude: float
    position: float
    tracking: float
    momentum_linear: float
    momentum_angular: float
    momentum_linear_relative: float
    momentum_angular_relative: float
    compile_seconds: float
    run_seconds: float

    def exceeded(self, tolerances: Tolerances) -> list[str]:
        """A phrase for each tolerance that is not kept; NaN keeps none."""
        checks = (
            ("base attitude differs by", self.attitude, tolerances.attitude, "rad"),
            ("base position differs by", self.position, tolerances.position, "m"),
            ("joint tracking misses by", self.tracking, tolerances.tracking, "rad or m"),
        )
        return [
            f"{what} {value:.2g} {unit} ({limit:g} allowed)"
            for what, value, limit, unit in checks
            if not value <= limit
        ]


@dataclass(frozen=True)
class CrosscheckReport:
    """Every engine at every step length, coarsest step first, and the verdict at the finest."""

    robot: str
    duration: float
    momentum: tuple[float, ...]
    tolerances: Tolerances
    comparisons: tuple[Comparison, ...]

    @property
    def engines(self) -> tuple[str, ...]:
        """Engines in the order in which they ran."""
        return tuple(dict.fromkeys(entry.engine for entry in self.comparisons))

    def of_engine(self, engine: str) -> tuple[Comparison, ...]:
        """The comparisons of one engine, coarsest step first."""
        return tuple(entry for entry in self.comparisons if entry.engine == engine)

    def shrinks(self, engine: str) -> bool | None:
        """Whether attitude and position differences are smaller at the finest step; None for one step."""
        first, last = self.of_engine(engine)[0], self.of_engine(engine)[-1]
        if first is last:
            return None
        return last.attitude < first.attitude and last.position < first.position

    def failures(self) -> list[str]:
        """A clause for each engine that fails: tolerances at its finest step, then growth with the step.

        A difference under a hundredth of its tolerance may do as it likes when the step shrinks.
        """
        found = []
        for engine in self.engines:
            first, last = self.of_engine(engine)[0], self.of_engine(engine)[-1]
            reasons = last.exceeded(self.tolerances)
            for what in ("attitude", "position"):
                fine, coarse = getattr(last, what), getattr(first, what)
                small = fine <= _FLOOR * getattr(self.tolerances, what)
                if not reasons and first is not last and not (small or fine < coarse):
                    reasons.append(f"the {what} difference does not shrink with the step")
            if reasons:
                title = ENGINE_TITLES[engine]
                found.append(f"in {title} with {_milliseconds(last.step)} steps " + ", ".join(reasons))
        return found

    @property
    def passed(self) -> bool:
        """Whether every engine keeps every tolerance at its finest step and converges."""
        return not self.failures()

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        failures = self.failures()
        if failures:
            return "The cross-check failed: " + "; ".join(failures) + "."
        finest = [self.of_engine(engine)[-1] for engine in self.engines]
        names = " and ".join(ENGINE_TITLES[engine] for engine in self.engines)
        return (
            f"{names} reproduce{'s' if len(finest) == 1 else ''} the motion: base attitude within "
            f"{max(entry.attitude for entry in finest):.2g} rad, base position within "
            f"{max(entry.position for entry in finest):.2g} m."
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, lists and text, ready for JSON; a number that is not finite becomes None."""
        rows = []
        for entry in self.comparisons:
            row = {item.name: getattr(entry, item.name) for item in fields(entry)}
            rows.append({key: finite_or_none(value) for key, value in row.items()})
        return {
            "robot": self.robot,
            "duration": self.duration,
            "momentum": list(self.momentum),
            "tolerances": {item.name: getattr(self.tolerances, item.name) for item in fields(Tolerances)},
            "comparisons": rows,
            "shrinks": {engine: self.shrinks(engine) for engine in self.engines},
            "passed": self.passed,
            "sentence": self.sentence,
        }

    def to_text(self) -> str:
        """A table with one row per engine and step, and the sentence below it."""
        head = ("engine", "step", "attitude", "position", "tracking", "P error", "L error", "compile", "run")
        units = ("", "ms", "rad", "m", "rad or m", "N s", "N m s", "s", "s")
        rows = [head, units]
        for entry in self.comparisons:
            numbers = (
                entry.attitude,
                entry.position,
                entry.tracking,
                entry.momentum_linear,
                entry.momentum_angular,
            )
            rows.append(
                (
                    ENGINE_TITLES[entry.engine],
                    f"{1e3 * entry.step:.4g}",
                    *(f"{number:.2e}" for number in numbers),
                    f"{entry.compile_seconds:.1f}",
                    f"{entry.run_seconds:.1f}",
                )
            )
        return "\n".join([*aligned(rows), self.sentence])


def _milliseconds(step: float) -> str:
    return f"{1e3 * step:.4g} ms"
