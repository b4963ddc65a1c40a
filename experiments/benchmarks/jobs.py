"""Which opponents do which work on which case, on one core and on all."""

from __future__ import annotations

from dataclasses import dataclass

from experiments.benchmarks.cases import BATCHES, FLOAT32, ONE_EVALUATION, ROBOTS, STEPS, Case
from experiments.benchmarks.opponents import registry as r
from experiments.benchmarks.planning_work import GENERATION, INDEX_GRADIENT, VALUE

EVERYONE = tuple(r.OPPONENTS)
TWISTS = tuple(name for name in EVERYONE if name != r.SHARED)  # one evaluation is the same in both ways
MAIN = (r.FAST, r.PLAIN, r.OBVIOUS, r.PINOCCHIO, r.SHARED, r.KERNEL)
REFERENCE = Case()
PLANNING = (VALUE, INDEX_GRADIENT, GENERATION)


@dataclass(frozen=True)
class Job:
    """Some work on one case by several opponents, timed in turn."""

    work: str
    case: Case
    opponents: tuple[str, ...]
    axis: str = ""


def groups(all_cores: bool, quick: bool) -> list[list[Job]]:
    """The list for one process; jobs of a group are timed in turn, so that ratios between them are fair.

    quick leaves most of the axes out.
    """
    single = REFERENCE.varied(precision=FLOAT32)
    if all_cores:
        # The engines called from Python, and the libraries that only give a mass matrix, are not faster here.
        found = [
            [Job(r.ROLLOUT, REFERENCE, MAIN), Job(r.ROLLOUT, single, (r.FAST,), "precision")],
            [Job(work, REFERENCE, (r.FAST,)) for work in PLANNING],
        ]
        if not quick:
            found.append([Job(r.ROLLOUT, REFERENCE.varied(batch=16384), (r.FAST, r.KERNEL), "batch")])
            found.append([Job(r.GRADIENT, REFERENCE, (r.FAST,))])
        return found
    found = [
        [Job(r.ROLLOUT, REFERENCE, EVERYONE), Job(r.ROLLOUT, single, (r.FAST, r.OBVIOUS), "precision")],
        [Job(r.ROLLOUT, REFERENCE.varied(batch=1), MAIN, "batch")],
        [Job(work, REFERENCE, (r.FAST, r.PLAIN)) for work in PLANNING],
        [Job(r.TWIST, REFERENCE.varied(batch=ONE_EVALUATION), TWISTS)],
    ]
    if quick:
        return found
    found.append(
        [
            Job(r.GRADIENT, REFERENCE, (r.FAST, r.PLAIN, r.OBVIOUS, r.DIFFRAX)),
            Job(r.GRADIENT, single, (r.FAST,), "precision"),
        ]
    )
    cases = [("batch", REFERENCE.varied(batch=batch)) for batch in BATCHES if batch != 1]
    cases += [("steps", REFERENCE.varied(steps=steps)) for steps in STEPS]
    cases += [("robot", REFERENCE.varied(robot_name=name)) for name in ROBOTS.values()]
    found += [[Job(r.ROLLOUT, case, MAIN, axis)] for axis, case in cases if case != REFERENCE]
    return found
