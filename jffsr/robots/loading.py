"""Loading a robot by catalogue name or from a file."""

from __future__ import annotations

import difflib
from functools import lru_cache
from importlib import resources
from pathlib import Path

from jffsr.errors import InputError
from jffsr.robots.builder import build_robot
from jffsr.robots.description import RobotDescription
from jffsr.robots.robot import Robot
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


def describe_robot(name: str | Path) -> RobotDescription:
    """The description behind `load_robot`: sources, notes and data as the file states them."""
    text = str(name)
    if not text.lower().endswith((".yaml", ".yml")):
        catalogue = _catalogue()
        aliases = {alias: key for key, model in catalogue.items() for alias in model.aliases}
        key = text if text in catalogue else aliases.get(text)
        if key is not None:
            return catalogue[key].describe(f"catalogue robot '{key}'")
        known = [*catalogue, *aliases]
        near = difflib.get_close_matches(text, known, n=1, cutoff=0.0)
        raise InputError(
            f"robot '{text}' is not in the catalogue; did you mean '{near[0]}'? "
            f"(known: {', '.join(sorted(known))}; or give a path to a .yaml file)"
        )
    path = Path(name)
    if not path.is_file():
        raise InputError(f"robot file '{path}' does not exist")
    return _parse(path.read_text(encoding="utf-8"), str(path)).describe(str(path))


@lru_cache(maxsize=1)
def _catalogue() -> dict[str, RobotModel]:
    folder = resources.files("jffsr.robots") / "data"
    models = {}
    for entry in folder.iterdir():
        if entry.name.endswith(".yaml"):
            model = _parse(entry.read_text(encoding="utf-8"), entry.name)
            models[model.name] = model
    return models


def _parse(text: str, origin: str) -> RobotModel:
    import yaml

    return RobotModel.model_validate(yaml.safe_load(text))
