"""The ratios that the package promises of itself, from the measurements of one run."""

from __future__ import annotations

from dataclasses import dataclass

from experiments.benchmarks.cases import FLOAT32, FLOAT64
from experiments.benchmarks.opponents import registry as r

AT_LEAST, AT_MOST = ">=", "<="
HOLDS, FAILS, UNKNOWN = "holds", "does not hold", "not measured"
MEMORY_LIMIT_GIB = 4.0


@dataclass(frozen=True)
class Target:
    """A ratio, or a number of GiB, and its bound; value None where something it needs was not measured."""

    name: str
    value: float | None
    relation: str
    bound: float

    @property
    def verdict(self) -> str:
        """holds, does not hold, or not measured."""
        if self.value is None:
            return UNKNOWN
        within = self.value >= self.bound if self.relation == AT_LEAST else self.value <= self.bound
        return HOLDS if within else FAILS


def targets(rows: list[dict]) -> list[Target]:
    """All targets, at the reference point unless they say otherwise; times are medians."""

    def each(work: str, opponent: str, **where) -> float | None:
        return seconds_each(rows, work, opponent, **where)

    fast = each(r.ROLLOUT, r.FAST)
    cores = max((row["threads"] for row in rows if row.get("kind") == "device"), default=1)
    everywhere = each(r.ROLLOUT, r.FAST, threads=cores) if cores > 1 else None
    memory = next((row for row in rows if row.get("kind") == "memory"), None)
    peak, rollouts = (None, 65_536) if memory is None else (memory["peak_bytes"] / 2**30, memory["rollouts"])
    found = [
        Target("Pinocchio C++ / jffsr, one core", _ratio(each(r.ROLLOUT, r.PINOCCHIO), fast), AT_LEAST, 6),
        Target("obvious JAX / jffsr, one core", _ratio(_fastest(each), fast), AT_LEAST, 25),
        Target("jffsr on one core / on two", _ratio(fast, everywhere), AT_LEAST, 1.7),
        Target(
            "float64 / float32, jffsr", _ratio(fast, each(r.ROLLOUT, r.FAST, precision=FLOAT32)), AT_LEAST, 2
        ),
        Target(
            "index with gradient / index, jffsr",
            _ratio(each("index and gradient", r.FAST), each("index", r.FAST)),
            AT_MOST,
            4,
        ),
        Target("jffsr / vectorised C++ kernel", _ratio(fast, each(r.ROLLOUT, r.KERNEL)), AT_MOST, 4),
        Target(
            "plain path / jffsr, batch of one",
            _ratio(each(r.ROLLOUT, r.PLAIN, batch=1), each(r.ROLLOUT, r.FAST, batch=1)),
            AT_LEAST,
            1,
        ),
        Target(f"peak memory of {rollouts:,} rollouts with gradients, GiB", peak, AT_MOST, MEMORY_LIMIT_GIB),
    ]
    return found


def seconds_each(
    rows: list[dict],
    work: str,
    opponent: str,
    *,
    threads: int = 1,
    batch: int = 1024,
    steps: int = 200,
    precision: str = FLOAT64,
    robot: str = "servicer_7dof",
) -> float | None:
    """Median seconds of one rollout (or evaluation), None where it was not measured."""
    wanted = {
        "work": work, "opponent": opponent, "threads": threads, "batch": batch, "steps": steps,
        "precision": precision, "robot": robot,
    }  # fmt: skip
    for row in rows:
        if "median" in row and all(row.get(key) == value for key, value in wanted.items()):
            return row["median"] / row["done"]
    return None


def _fastest(each) -> float | None:
    """The faster of the two plain ways to write it in JAX: the opponent is the better one."""
    found = [x for x in (each(r.ROLLOUT, r.OBVIOUS), each(r.ROLLOUT, r.PLAIN)) if x is not None]
    return min(found, default=None)


def _ratio(above: float | None, below: float | None) -> float | None:
    return above / below if above is not None and below is not None else None
