"""One plain mapping out of a file, the files that it builds on, and overrides; with the source of every key.

A file's `defaults` list names files (relative to it, `.yaml` may be left out). Later entries win over earlier
ones, the file over all of them, overrides over the file. Mappings merge, lists and values are replaced.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jffsr.errors import InputError
from jffsr.reading.did_you_mean import hint
from jffsr.reading.files import read_text
from jffsr.reading.sources import Sources
from jffsr.reading.yaml_lines import Document, Key, Mark, parse
from jffsr.study.lookup import shown, with_suffixes

MAX_FILES = 50
MAX_LEVELS = 10
_OVERRIDE_KEY = re.compile(r"[A-Za-z_]\w*(\.\w+){0,20}", re.ASCII)
_FILE_ENDINGS = (".yaml", ".yml", ".urdf", ".xml", ".mjcf")


def compose(path: Path, overrides: Sequence[str]) -> tuple[dict[str, Any], Sources]:
    """The composed mapping of a study and the sources of its keys; raises InputError."""
    documents: list[Document] = []
    _collect(path, [], documents)
    # A name belongs to one file: a study that builds on another is not that other study.
    for document in documents[:-1]:
        document.value.pop("name", None)
        document.marks.pop(("name",), None)
    main = len(documents) - 1
    documents += [override(text) for text in _checked(overrides)]
    return _merge(documents, main), Sources(tuple(document.marks for document in documents), main)


def compose_over(
    values: dict[str, Any], sources: Sources, overrides: Sequence[Document]
) -> tuple[dict[str, Any], Sources]:
    """A composed mapping under further overrides, each a document of (dotted key, value)."""
    layers = (*sources.layers, *(document.marks for document in overrides))
    return _merge([Document(values, {}), *overrides], 0), Sources(layers, sources.main)


def _collect(path: Path, above: list[Path], documents: list[Document]) -> None:
    """Append the documents of the file, those that it builds on before it."""
    source = shown(path)
    document = parse(read_text(path, source), source)
    if document.value is None:
        raise InputError(f"{source}: the file is empty, a mapping of keys is expected")
    if not isinstance(document.value, dict):
        place = document.marks[()].place
        robot = path.suffix.lower() in (".urdf", ".xml", ".mjcf")
        advice = "; this is a robot's file, and a study names it under the key 'robot'" if robot else ""
        raise InputError(f"{place}: a mapping of keys is expected, such as 'kind: planning'{advice}")
    chain = [*above, path]
    names = document.value.pop("defaults", None)
    if names is not None and not isinstance(names, list):
        mark = document.marks[("defaults",)]
        found = "a mapping" if mark.text is None else repr(mark.text[:60])
        raise InputError(f"{mark.place}: defaults: found {found}, a list of files is expected")
    for i, name in enumerate(names or []):
        place = f"{document.marks[('defaults', str(i))].place}: defaults"
        included = _included(path, name, place)
        if any(os.path.samefile(included, other) for other in chain):
            loop = " -> ".join(shown(p) for p in [*chain, included])
            raise InputError(f"{place}: the files build on each other in a circle ({loop})")
        if len(chain) >= MAX_LEVELS:
            raise InputError(f"{place}: files build on files more than {MAX_LEVELS} levels deep")
        _collect(included, chain, documents)
        if len(documents) > MAX_FILES:
            raise InputError(f"{place}: the study builds on more than {MAX_FILES} files")
    anchor_files(document.value, path.parent)
    documents.append(document)


def _included(path: Path, name: Any, place: str) -> Path:
    if not isinstance(name, str) or not name.strip() or "\0" in name or len(name) > 1000:
        raise InputError(f"{place}: found {str(name)[:60]!r}, the name of a file is expected")
    for candidate in with_suffixes(path.parent / name):
        if os.path.isfile(candidate):
            return candidate
    folder = (path.parent / name).parent
    there = [p.stem for p in sorted(folder.glob("*.y*ml")) if p != path] if folder.is_dir() else []
    raise InputError(f"{place}: there is no file '{name}' next to {path.name}{hint(Path(name).stem, there)}")


def anchor_files(value: dict[str, Any], folder: Path) -> None:
    """Make paths absolute, of a robot and of a capability map: the composed study is written elsewhere."""
    robot = value.get("robot")
    if isinstance(robot, str) and ("/" in robot or robot.endswith(_FILE_ENDINGS)):
        value["robot"] = _absolute(robot, folder)
    section, key = (
        (value, "grasp_time.map") if "grasp_time.map" in value else (value.get("grasp_time"), "map")
    )
    if isinstance(section, dict) and isinstance(section.get(key), str):
        section[key] = _absolute(section[key], folder)


def _absolute(path: str, folder: Path) -> str:
    return path if "\0" in path else os.path.abspath(os.path.join(folder, os.path.expanduser(path)))


def _checked(overrides: Sequence[str]) -> list[str]:
    if isinstance(overrides, str):
        raise InputError(f"overrides are a list of 'key=value' texts, found one text {overrides[:60]!r}")
    for text in overrides:
        if not isinstance(text, str):
            raise InputError(f"found {str(text)[:60]!r} as an override, a text 'key=value' is expected")
    return list(overrides)


def override(text: str) -> Document:
    """A document whose value is (dotted key, value), of a text `key=value`; raises InputError."""
    line = " ".join(text.split())
    source = f"override '{line if len(line) <= 80 else line[:77] + '...'}'"
    dotted, equals, value = text.partition("=")
    dotted = dotted.strip()
    if not equals or not _OVERRIDE_KEY.fullmatch(dotted) or len(dotted) > 200:
        raise InputError(f"{source}: key=value is expected, the key dotted such as optimizer.particles")
    if dotted.split(".")[0] == "defaults":
        raise InputError(f"{source}: 'defaults' is read from files only")
    key: Key = tuple(dotted.split("."))
    document = parse(value, source, key, with_lines=False)
    marks = document.marks or {key: Mark(source, None, "")}
    payload = {dotted: document.value}
    anchor_files(payload, Path.cwd())
    return Document((dotted, payload[dotted]), marks)


def _merge(documents: list[Document], main: int) -> dict[str, Any]:
    # OmegaConf is loaded here and not above, so that importing the configuration stays quick.
    from omegaconf import OmegaConf
    from omegaconf.errors import OmegaConfBaseException

    merged = OmegaConf.create({})
    for i, document in enumerate(documents):
        key, value = ("", document.value) if i <= main else document.value
        try:
            if i <= main:
                merged = OmegaConf.merge(merged, value)
            else:
                _mark_new_sections(OmegaConf.to_container(merged), key.split("."), document.marks)
                OmegaConf.update(merged, key, value, merge=True)
        except (OmegaConfBaseException, TypeError, ValueError, IndexError):
            raise InputError(_clash(OmegaConf.to_container(merged), document, key)) from None
    return OmegaConf.to_container(merged, resolve=False)


def _mark_new_sections(merged: Any, parts: list[str], marks: dict[Key, Mark]) -> None:
    """An override also stands for each section around its key that it makes itself."""
    here = merged
    for i, part in enumerate(parts[:-1]):
        if isinstance(here, list):
            here = here[int(part)] if part.isdecimal() and int(part) < len(here) else None
        else:
            here = here.get(part) if isinstance(here, dict) else None
        if not isinstance(here, dict | list):
            marks.setdefault(tuple(parts[: i + 1]), marks[tuple(parts)])


def _clash(merged: dict[str, Any], document: Document, dotted: str) -> str:
    """The sentence for a value that cannot be put where it is meant to go."""
    key = tuple(dotted.split(".")) if dotted else ()
    value = document.value[1] if dotted else document.value
    here: Any = merged
    for i, part in enumerate(key):
        if isinstance(here, list):
            if not part.isdecimal() or int(part) >= len(here):
                place = f"{document.marks[key].place}: {dotted}"
                return f"{place}: '{'.'.join(key[:i])}' is a list of {len(here)}, its entries count from 0"
            here = here[int(part)]
        else:
            here = here.get(part) if isinstance(here, dict) else None
    found = _different(here, value, key)
    if found is None:
        return f"{document.marks[key].place}: {dotted}: this value cannot be set"
    new, old = ("a list", "a mapping") if isinstance(found[1], list) else ("a mapping", "a list")
    place = f"{document.marks[found[0]].place}: {'.'.join(found[0])}"
    return f"{place}: found {new}, where {old} was given before"


def _different(old: Any, new: Any, key: Key) -> tuple[Key, Any] | None:
    if isinstance(old, dict) and isinstance(new, dict):
        parts = (_different(old[name], new[name], (*key, name)) for name in new if name in old)
        return next((part for part in parts if part), None)
    kinds = {type(old), type(new)}
    return (key, new) if kinds == {dict, list} else None
