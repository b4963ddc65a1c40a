"""From a sweep's specification to its points, each a planning configuration validated like one of its own."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from itertools import product
from typing import Any

from jffsr.errors import InputError
from jffsr.reading.yaml_lines import Document
from jffsr.study.composition import compose_over
from jffsr.study.config import validated
from jffsr.study.schema import PlanningConfig
from jffsr.study.sweep.specification import Specification

MOST_POINTS = 100_000


@dataclass(frozen=True)
class Point:
    """A point of a sweep: its number, what the sweep set there, and the configuration that this makes."""

    number: int
    values: dict[str, Any]
    config: PlanningConfig

    @property
    def label(self) -> str:
        """For messages."""
        return label(self.number, self.values)


def label(number: int, values: dict[str, Any]) -> str:
    """A point for messages: its number, and what is set there."""
    text = ", ".join(f"{key}={value_text(value)}" for key, value in values.items())
    return f"point {number}: {text if len(text) <= 160 else text[:157] + '...'}"


def value_text(value: Any) -> str:
    """A swept value as a person writes it."""
    return value if isinstance(value, str) else json.dumps(value)


def expand(spec: Specification) -> list[Point]:
    """All points, in order; InputError names the point, the key and where its value was written.

    Points that differ in nothing but their seed are validated once.
    """
    axes = [list(spec.listed) or [()], list(spec.draws.points) if spec.draws else [()]]
    axes += [[(item,) for item in items] for items in spec.grid.values()]
    seeds = spec.seeds or (None,)
    count = math.prod(map(len, axes)) * len(seeds)
    if count > MOST_POINTS:
        raise InputError(f"{spec.source}: the sweep has {count} points, at most {MOST_POINTS} are computed")
    points: list[Point] = []
    for parts in product(*axes):
        documents = [document for part in parts for document in part]
        values = dict(document.value for document in documents)
        first = {**values, "seed": seeds[0]} if spec.seeds else values
        config = _config(spec, documents, label(len(points), first))
        for seed in seeds:
            if seed is None:
                points.append(Point(len(points), values, config))
            else:
                seeded = config.model_copy(update={"seed": seed})
                points.append(Point(len(points), {**values, "seed": seed}, seeded))
    return points


def _config(spec: Specification, documents: list[Document], name: str) -> PlanningConfig:
    try:
        values, sources = compose_over(spec.base, spec.sources, [*spec.fixed, *documents])
        config = validated(values, sources, spec.stem)
        if not isinstance(config, PlanningConfig):
            raise InputError(
                f"{config.where('kind')}: found '{config.kind}', only planning studies are swept over"
            )
        return config
    except InputError as error:
        raise InputError(f"{error} ({name})") from None
