"""Loading a robot by catalogue name or from a file."""

from __future__ import annotations

import os
from functools import lru_cache
from importlib import resources
from pathlib import Path

from pydantic import ValidationError

from jffsr.errors import InputError
from jffsr.reading.complaints import complaint
from jffsr.reading.did_you_mean import hint
from jffsr.reading.files import read_text
from jffsr.reading.sources import Sources
from jffsr.reading.yaml_lines import parse
from jffsr.robots.builder import build_robot
from jffsr.robots.description import RobotDescription
from jffsr.robots.robot import Robot
from jffsr.robots.trail import Trail
from jffsr.robots.yaml_schema import RobotModel


def list_robots() -> tuple[str, ...]:
    """Names of the catalogue's robots, sorted."""
    return tuple(sorted(_catalogue()))


def load_robot(name: str | Path) -> Robot:
    """The robot of a catalogue name, an alias, or a path to a .yaml file.

    Raises InputError, naming file, body and reason, when the file does not exist, cannot be read, or
    describes what no rigid body or tree can be.
    """
    return build_robot(describe_robot(name))


def describe_robot(name: str | Path, trail: Trail | None = None) -> RobotDescription:
    """The description behind `load_robot`: sources, notes and data as the file states them.

    `trail` says which robots this one is an arm of.
    """
    text = str(name)
    trail = trail or Trail()
    if not text.lower().endswith((".yaml", ".yml")):
        catalogue = _catalogue()
        aliases = {alias: key for key, model in catalogue.items() for alias in model.aliases}
        key = text if text in catalogue else aliases.get(text)
        if key is not None:
            find = trail.arms_of(key, key, _data(), describe_robot)
            return catalogue[key].describe(f"catalogue robot '{key}'", find)
        known = sorted([*catalogue, *aliases])
        raise InputError(
            f"robot '{text}' is not in the catalogue{hint(text, known)} "
            f"(known: {', '.join(known)}; or give a path to a .yaml file)"
        )
    path = Path(name)
    model = _parse(read_text(path, text), text)
    return model.describe(text, trail.arms_of(text, os.path.realpath(path), path.parent, describe_robot))


def _data() -> Path:
    return Path(str(resources.files("jffsr.robots"))) / "data"


@lru_cache(maxsize=1)
def _catalogue() -> dict[str, RobotModel]:
    models = {}
    for entry in _data().iterdir():
        if entry.name.endswith(".yaml"):
            model = _parse(entry.read_text(encoding="utf-8"), entry.name)
            models[model.name] = model
    return models


def _parse(text: str, origin: str) -> RobotModel:
    document = parse(text, origin)
    if not isinstance(document.value, dict):
        raise InputError(
            f"{origin}: a mapping with the keys {', '.join(RobotModel.model_fields)} is expected"
        )
    try:
        model = RobotModel.model_validate(document.value)
    except ValidationError as error:
        raise complaint(error, RobotModel, Sources((document.marks,))) from None
    model._sources = Sources((document.marks,))
    return model
