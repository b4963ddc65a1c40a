"""Finding a configuration by path or by name, and how a file is called in messages."""

from __future__ import annotations

import os
from pathlib import Path

from jffsr.errors import InputError
from jffsr.reading.did_you_mean import listed, nearest
from jffsr.reading.files import beside

SUFFIXES = (".yaml", ".yml")


def shown(path: Path) -> str:
    """The path as a reader would type it: relative to the current folder when the file lies under it."""
    absolute = os.path.abspath(path)
    relative = os.path.relpath(absolute)
    return absolute if relative.startswith(os.pardir) else relative


def config_roots() -> list[Path]:
    """The `configs` folders that are searched: the current folder's, then the repository's."""
    candidates = [Path("configs"), Path(__file__).resolve().parents[2] / "configs"]
    roots: dict[Path, Path] = {}
    for root in candidates:
        if root.is_dir():
            roots.setdefault(root.resolve(), root)
    return list(roots.values())


def find_config(name: str | os.PathLike[str]) -> Path:
    """The file of a configuration: a path, a name under `configs/`, or a stem that only one file there has.

    Raises InputError with the nearest names when there is none, or with all of them when there are several.
    """
    text = os.fspath(name)
    if not isinstance(text, str) or not text.strip() or "\0" in text or len(text) > 4000:
        raise InputError(f"found {text[:60]!r}, a configuration's path or name under configs/ is expected")
    for candidate in with_suffixes(Path(text)):
        if _is_there(candidate):
            return candidate
    known: list[Path] = []
    for root in config_roots():
        for candidate in with_suffixes(root / text):
            if _is_there(candidate):
                return candidate
        files = sorted(path for path in root.rglob("*") if path.suffix in SUFFIXES)
        matches = [path for path in files if text in (path.stem, path.name)]
        if len(matches) == 1:
            return matches[0]
        if matches:
            paths = listed(map(shown, matches))
            raise InputError(f"{text!r} is the name of several configurations, give one of {paths}")
        known += files
    if os.path.isdir(text):
        raise InputError(f"{text}: this is a folder, a YAML file is expected")
    stems = [path.stem for path in known]
    wanted = Path(text)
    neighbours = {Path(name).stem: name for name in beside(wanted, SUFFIXES)}
    if close := nearest(wanted.stem, neighbours):
        found = shown(wanted.with_name(neighbours[close[0]]))
        raise InputError(f"{text[:200]!r} is no file; did you mean '{found}'?")
    close = nearest(Path(text).stem, stems, 3)
    advice = f"; did you mean {listed(repr(stem) for stem in close)}?" if close else ""
    if not close and known:
        advice = f"; under configs/ there are {', '.join(stems[:10])}{', ...' if len(stems) > 10 else ''}"
    raise InputError(
        f"{text[:200]!r} is neither a file nor the name of a configuration under configs/{advice}"
    )


def with_suffixes(path: Path) -> list[Path]:
    """The path itself, then with `.yaml` and `.yml` added where it has neither."""
    if path.suffix in SUFFIXES:
        return [path]
    return [path, *(path.with_name(path.name + suffix) for suffix in SUFFIXES if path.name)]


def _is_there(path: Path) -> bool:
    # os.path and not Path, which raises for a name longer than the file system takes.
    return os.path.exists(path) and not os.path.isdir(path)
