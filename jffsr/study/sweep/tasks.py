"""The points of a sweep sorted into tasks: what shares its shapes is planned together, what does not, alone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import jax
import numpy as np

from jffsr.errors import InputError
from jffsr.optimizers.registry import Settings
from jffsr.planning.fingerprint import fingerprint
from jffsr.planning.problem import Problem
from jffsr.planning.result import Tolerances
from jffsr.planning.search import search_of
from jffsr.study.building import build_problem, build_settings, build_tolerances
from jffsr.study.schema import PlanningConfig
from jffsr.study.sweep.points import Point

TOGETHER = 64
"""Plans in one compiled call, at most: after each the results are on the disk."""


@dataclass(frozen=True)
class Setting:
    """What points that differ in their seed alone share; mark tells it from every other one."""

    problem: Problem
    optimizer: str
    settings: Settings
    step_factor: int
    tolerances: Tolerances
    precision: str
    mark: str = field(repr=False)


@dataclass(frozen=True)
class Task:
    """Points that one compiled call plans, `width` at a time; width None: one point, by `solve`.

    numbers are those of the points, settings and seeds theirs, marks tell whose results a part holds.
    """

    numbers: tuple[int, ...]
    settings: tuple[Setting, ...]
    seeds: tuple[int, ...]
    labels: tuple[str, ...]
    width: int | None

    @property
    def marks(self) -> tuple[str, ...]:
        """One for each point."""
        return tuple(
            f"{setting.mark}-{seed}" for setting, seed in zip(self.settings, self.seeds, strict=True)
        )

    @property
    def queued(self) -> bool:
        """Whether a worker process computes it, beside others, and not all devices of this one together."""
        return self.width is None or self.width == 1

    @property
    def title(self) -> str:
        """For messages."""
        if len(self.numbers) == 1:
            return self.labels[0]
        return f"points {self.numbers[0]} to {self.numbers[-1]} ({len(self.numbers)} of them)"

    def without(self, done: set[int]) -> Task | None:
        """The task less the points that are done; None where all are."""
        kept = [i for i, number in enumerate(self.numbers) if number not in done]
        if not kept:
            return None
        lists = {name: getattr(self, name) for name in ("numbers", "settings", "seeds", "labels")}
        return replace(self, **{name: tuple(values[i] for i in kept) for name, values in lists.items()})


def sort_into_tasks(points: Sequence[Point], together: int | None = None) -> list[Task]:
    """Tasks in the order of their first points, those of several points first.

    Building the problems here checks every point against its robot before anything is computed.
    """
    builder = _Builder()
    groups: dict[Any, list[tuple[Point, Setting]]] = {}
    for point in points:
        try:
            setting, shape = builder.setting(point.config)
        except InputError as error:
            raise InputError(f"{error} ({point.label})") from None
        groups.setdefault(shape if shape is not None else ("alone", point.number), []).append(
            (point, setting)
        )
    tasks = []
    for shape, members in groups.items():
        alone = shape[0] == "alone"
        parts = math.ceil(len(members) / (together or TOGETHER))
        width = math.ceil(len(members) / parts)
        for start in range(0, len(members), width):
            tasks.append(_task(members[start : start + width], None if alone else width))
    return sorted(tasks, key=lambda task: (task.queued, task.numbers[0]))


def _task(members: list[tuple[Point, Setting]], width: int | None) -> Task:
    return Task(
        numbers=tuple(point.number for point, _ in members),
        settings=tuple(setting for _, setting in members),
        seeds=tuple(point.config.seed for point, _ in members),
        labels=tuple(point.label for point, _ in members),
        width=width,
    )


class _Builder:
    """Builds each problem once, though many points have it."""

    def __init__(self) -> None:
        self._problems: dict[str, tuple[Problem, Any]] = {}
        self._settings: dict[str, tuple[Setting, Any]] = {}

    def setting(self, config: PlanningConfig) -> tuple[Setting, Any]:
        """The setting, and what of it must be equal to be planned together; None where it has to go alone."""
        written = config.model_dump(exclude={"seed", "name", "output"})
        key = repr(written)
        if key not in self._settings:
            problem, shape = self._problem(config, repr({**written, "optimizer": 0, "verification": 0}))
            optimizer, settings = build_settings(config)
            step_factor, tolerances = config.verification.step_factor, build_tolerances(config)
            numbers = (optimizer, settings, step_factor, tolerances, config.precision)
            setting = Setting(problem, *numbers, mark=fingerprint(problem, *numbers))
            self._settings[key] = (setting, _shared(setting, shape))
        return self._settings[key]

    def _problem(self, config: PlanningConfig, key: str) -> tuple[Problem, Any]:
        if key not in self._problems:
            problem = build_problem(config)
            self._problems[key] = (problem, _form(problem))
        return self._problems[key]


def _shared(setting: Setting, shape: Any) -> Any:
    phases, _ = search_of(setting.problem, setting.optimizer, setting.settings)
    lengths = tuple(float(phase.stop.iterations) for phase in phases)
    if setting.precision != "float64" or not all(map(math.isfinite, lengths)):
        return None
    optimizers = _form([(phase.optimizer, phase.stop) for phase in phases])
    return ("together", shape, optimizers, lengths, setting.step_factor, setting.tolerances)


def _form(tree: Any) -> tuple:
    leaves, structure = jax.tree.flatten(tree)
    return structure, tuple((np.shape(leaf), np.asarray(leaf).dtype.str) for leaf in leaves)
