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


def jobs(all_cores: bool, quick: bool) -> list[Job]:
    """The list for one process; quick leaves most of the axes out."""
    if all_cores:
        # The engines called from Python, and the libraries that only give a mass matrix, are not faster here.
        found = [Job(r.ROLLOUT, REFERENCE, MAIN), *(Job(work, REFERENCE, (r.FAST,)) for work in PLANNING)]
        if not quick:
            found.append(Job(r.ROLLOUT, REFERENCE.varied(batch=16384), (r.FAST, r.KERNEL), "batch"))
            found.append(Job(r.GRADIENT, REFERENCE, (r.FAST,)))
            found.append(Job(r.ROLLOUT, REFERENCE.varied(precision=FLOAT32), (r.FAST,), "precision"))
        return found
    found = [
        Job(r.ROLLOUT, REFERENCE, EVERYONE),
        Job(r.ROLLOUT, REFERENCE.varied(precision=FLOAT32), (r.FAST, r.OBVIOUS), "precision"),
        Job(r.ROLLOUT, REFERENCE.varied(batch=1), MAIN, "batch"),
        *(Job(work, REFERENCE, (r.FAST, r.PLAIN)) for work in PLANNING),
        Job(r.TWIST, REFERENCE.varied(batch=ONE_EVALUATION), TWISTS),
    ]
    if quick:
        return found
    found.append(Job(r.GRADIENT, REFERENCE, (r.FAST, r.PLAIN, r.OBVIOUS, r.DIFFRAX)))
    found.append(Job(r.GRADIENT, REFERENCE.varied(precision=FLOAT32), (r.FAST,), "precision"))
    for batch in BATCHES:
        if batch not in (1, REFERENCE.batch):
            found.append(Job(r.ROLLOUT, REFERENCE.varied(batch=batch), MAIN, "batch"))
    for steps in STEPS:
        if steps != REFERENCE.steps:
            found.append(Job(r.ROLLOUT, REFERENCE.varied(steps=steps), MAIN, "steps"))
    for name in ROBOTS.values():
        if name != REFERENCE.robot_name:
            found.append(Job(r.ROLLOUT, REFERENCE.varied(robot_name=name), MAIN, "robot"))
    return found
