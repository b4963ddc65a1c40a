"""Loading a robot by catalogue name or from a file."""

from __future__ import annotations

import os
from functools import cache
from importlib import resources
from pathlib import Path

from pydantic import ValidationError

from jffsr.errors import InputError
from jffsr.reading.complaints import complaint
from jffsr.reading.did_you_mean import hint
from jffsr.reading.files import read_text
from jffsr.reading.sources import Sources
from jffsr.reading.xml_tree import parse_xml
from jffsr.reading.yaml_lines import parse
from jffsr.robots.builder import build_robot
from jffsr.robots.description import RobotDescription
from jffsr.robots.formats.mjcf import describe_mjcf
from jffsr.robots.formats.urdf import describe_urdf
from jffsr.robots.robot import Robot
from jffsr.robots.trail import Trail
from jffsr.robots.yaml_schema import RobotModel

YAML_SUFFIXES = (".yaml", ".yml")
XML_SUFFIXES = (".urdf", ".xml", ".mjcf")
MOST_XML = 10_000_000
"""Bytes of an XML file: some publish arms with their vertices in the text."""
_ALLOWED = ".yaml, .yml, .urdf, .xml or .mjcf"


def list_robots() -> tuple[str, ...]:
    """Names of the catalogue's robots, sorted."""
    return tuple(sorted(_catalogue()))


def load_robot(name: str | Path) -> Robot:
    """The robot of a catalogue name, an alias, or a path to a .yaml, .urdf, .xml or .mjcf file.

    The element at the top of an XML file says whether it is URDF (<robot>) or MJCF (<mujoco>). Raises
    InputError, naming file, body and reason, when the file does not exist, cannot be read, describes what
    no rigid body or tree can be, or has what a tree of rigid bodies on a free base has not.
    """
    return build_robot(describe_robot(name))


def describe_robot(name: str | Path, trail: Trail | None = None) -> RobotDescription:
    """The description behind `load_robot`: sources, notes and data as the file states them.

    `trail` says which robots this one is an arm of.
    """
    text = str(name)
    trail = trail or Trail()
    suffix = Path(text).suffix.lower()
    if suffix in YAML_SUFFIXES:
        path = Path(name)
        model = _parse(read_text(path, text), text)
        return model.describe(text, trail.arms_of(text, os.path.realpath(path), path.parent, describe_robot))
    if suffix in XML_SUFFIXES:
        return _describe_xml(Path(name), text)
    catalogue = _by_file_name(text) or _catalogue()
    aliases = {alias: key for key, model in catalogue.items() for alias in model.aliases}
    key = text if text in catalogue else aliases.get(text)
    if key is not None:
        find = trail.arms_of(key, key, _data(), describe_robot)
        return catalogue[key].describe(f"catalogue robot '{key}'", find)
    if "/" in text or "\\" in text or _exists(text):
        kind = f"files of type '{suffix}'" if suffix else "files without a type"
        raise InputError(f"{text}: {kind} are not read as robots (allowed: {_ALLOWED})")
    known = sorted([*catalogue, *aliases])
    raise InputError(
        f"robot '{text}' is not in the catalogue{hint(text, known)} "
        f"(known: {', '.join(known)}; or give a path to a {_ALLOWED} file)"
    )


def _exists(text: str) -> bool:
    try:
        return Path(text).is_file()
    except (OSError, ValueError):
        return False


def _describe_xml(path: Path, shown: str) -> RobotDescription:
    root = parse_xml(read_text(path, shown, "URDF or MJCF", MOST_XML), shown)
    if root.tag == "robot":
        return describe_urdf(root, shown, path.parent)
    if root.tag == "mujoco":
        return describe_mjcf(root, shown, path.parent)
    raise InputError(
        f"{shown}:{root.line}: the first element is <{root.tag[:60]}>; <robot> (URDF) or <mujoco> (MJCF) is expected"
    )


def _data() -> Path:
    return Path(str(resources.files("jffsr.robots"))) / "data"


def _catalogue() -> dict[str, RobotModel]:
    models = (_entry(path.stem) for path in _data().iterdir() if path.suffix == ".yaml")
    return {model.name: model for model in models}


def _by_file_name(name: str) -> dict[str, RobotModel]:
    """The part of the catalogue that a robot is found in without reading all files: its own, named after it."""
    own = name.isidentifier() and _exists(str(_data() / f"{name}.yaml"))
    return {name: _entry(name)} if own else {}


@cache
def _entry(stem: str) -> RobotModel:
    file = f"{stem}.yaml"
    return _parse((_data() / file).read_text(encoding="utf-8"), file)


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
