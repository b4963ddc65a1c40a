"""What a sweep varies, and over what.

Written in a file of kind `sweep`, or as key=v1,v2 behind the name of a planning configuration; both give the same.
A sweep's points are every combination of one entry of `list`, one of the `random` draws, one value of each key of
`grid`, and one of the `seeds`, in this order, the last changing fastest.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from jffsr.errors import InputError
from jffsr.reading.files import read_text
from jffsr.reading.sources import Sources
from jffsr.reading.yaml_lines import Document, parse
from jffsr.study.composition import anchor_files, compose, override
from jffsr.study.config import dump_values, name_from
from jffsr.study.lookup import find_config, shown, with_suffixes
from jffsr.study.sweep.arguments import Argument, read_arguments
from jffsr.study.sweep.draws import Draws, read_draws
from jffsr.study.sweep.entries import Entries, check_key

SWEEP = "sweep"
KEYS = ("kind", "name", "base", "set", "grid", "list", "random", "seeds")
MOST_SEEDS = 100_000
LARGEST_SEED = 2**32 - 1


@dataclass(frozen=True)
class Specification:
    """A sweep as read: each value a Document of (dotted key, value) with the mark of where it was written.

    base and sources are the composed planning configuration that every point builds on, not yet validated;
    fixed holds what is set at all points.
    """

    name: str
    stem: str
    source: str
    base: dict[str, Any]
    sources: Sources
    fixed: tuple[Document, ...] = ()
    listed: tuple[tuple[Document, ...], ...] = ()
    draws: Draws | None = None
    grid: dict[str, tuple[Document, ...]] = field(default_factory=dict)
    seeds: tuple[int, ...] = ()

    @property
    def robots(self) -> tuple[str, ...]:
        """The robots that the sweep names, each as a catalogue's name or an absolute path."""
        documents = (
            *self.fixed,
            *self.grid.get("robot", ()),
            *(item for entry in self.listed for item in entry),
        )
        named = [document.value[1] for document in documents if document.value[0] == "robot"]
        return tuple(robot for robot in [self.base.get("robot"), *named] if isinstance(robot, str))

    def to_yaml(self, robots: Mapping[str, str] | None = None) -> str:
        """The sweep with its base inside, from which it can be repeated; robots gives other names to some of them."""

        def named(key: str, value: Any) -> Any:
            is_robot = key == "robot" and isinstance(value, str)
            return (robots or {}).get(value, value) if is_robot else value

        base = {key: named(key, value) for key, value in self.base.items()}
        values: dict[str, Any] = {"kind": SWEEP, "name": self.name, "base": {"name": self.stem, **base}}
        if self.fixed:
            values["set"] = {key: named(key, value) for key, value in (item.value for item in self.fixed)}
        if self.grid:
            values["grid"] = {
                key: [named(key, item.value[1]) for item in items] for key, items in self.grid.items()
            }
        if self.listed:
            values["list"] = [
                {key: named(key, value) for key, value in (item.value for item in entry)}
                for entry in self.listed
            ]
        if self.draws is not None:
            values["random"] = self.draws.values
        if self.seeds:
            values["seeds"] = list(self.seeds)
        return dump_values(values)


def is_sweep(path_or_name: str) -> bool:
    """Whether a configuration's file says `kind: sweep`."""
    path = find_config(path_or_name)
    value = parse(read_text(path, shown(path)), shown(path)).value
    return isinstance(value, dict) and value.get("kind") == SWEEP


def read_sweep(path_or_name: str, arguments: Sequence[str] = ()) -> Specification:
    """The sweep of a file, with the values of the command line in place of its own; raises InputError.

    Of a planning configuration it is the one that the command line's `key=v1,v2` alone describe.
    """
    path = find_config(path_or_name)
    source = shown(path)
    changes = read_arguments(arguments)
    if is_sweep(path_or_name):
        spec = _from_file(path, source)
    else:
        base, sources = compose(path, ())
        spec = Specification(base.get("name") or name_from(path.stem), path.stem, source, base, sources)
    spec = _changed(spec, changes)
    if not (spec.grid or spec.listed or spec.draws or spec.seeds):
        raise InputError(
            f"{source}: there is nothing to sweep; give values such as optimizer.particles=32,64 or seeds=20, or a "
            f"file of kind 'sweep' with a grid, a list, random draws or seeds"
        )
    _refuse_twice(spec)
    return spec


def _from_file(path: Path, source: str) -> Specification:
    entries = Entries(parse(read_text(path, source), source), path.parent)
    entries.refuse_unknown((), KEYS)
    stem, base, sources = _base(entries, path)
    name = entries.value("name")
    if name is not None and (not isinstance(name, str) or name_from(name) != name or not name.strip(".")):
        raise entries.refusal(
            ("name",), "a name of at most 100 letters, digits, '_', '.' and '-' is expected"
        )
    grid = {
        key: tuple(
            entries.document(key, value, ("grid", key, str(i)))
            for i, value in enumerate(entries.list_at(("grid", key), "values"))
        )
        for key in entries.keys_at(("grid",))
    }
    listed = tuple(
        tuple(
            entries.document(key, entries.value("list", str(i), key), ("list", str(i), key))
            for key in entries.keys_at(("list", str(i)))
        )
        for i in range(len(entries.list_at(("list",), "mappings of keys") if entries.has("list") else ()))
    )
    fixed = tuple(
        entries.document(key, entries.value("set", key), ("set", key)) for key in entries.keys_at(("set",))
    )
    return Specification(
        name=name or name_from(path.stem),
        stem=stem,
        source=source,
        base=base,
        sources=sources,
        fixed=fixed,
        listed=listed,
        draws=read_draws(entries) if entries.has("random") else None,
        grid=grid,
        seeds=_seeds(entries.value("seeds"), lambda what: entries.refusal(("seeds",), what))
        if entries.has("seeds")
        else (),
    )


def _base(entries: Entries, path: Path) -> tuple[str, dict[str, Any], Sources]:
    """The stem and the composed mapping of the planning configuration that the file names or holds."""
    base = entries.value("base")
    if isinstance(base, dict):
        marks = {key[1:]: mark for key, mark in entries.document_marks.items() if key[:1] == ("base",)}
        base = dict(base)
        anchor_files(base, path.parent)
        return str(base.get("name") or path.stem), base, Sources((marks,), 0)
    if not isinstance(base, str):
        raise entries.refusal(
            ("base",), "missing or no text, the path or name of a planning configuration is expected"
        )
    beside = [candidate for candidate in with_suffixes(path.parent / base) if candidate.is_file()]
    there = beside[0] if beside else base
    try:
        found = find_config(there)
    except InputError as error:
        raise entries.refusal(("base",), str(error)) from None
    return found.stem, *compose(found, ())


def _seeds(value: Any, refusal: Any) -> tuple[int, ...]:
    def whole(item: Any, low: int, high: int) -> bool:
        return isinstance(item, int) and not isinstance(item, bool) and low <= item <= high

    if whole(value, 1, MOST_SEEDS):
        return tuple(range(value))
    if isinstance(value, list) and value and all(whole(item, 0, LARGEST_SEED) for item in value):
        if len(set(value)) < len(value):
            raise refusal("a seed is given twice")
        return tuple(value)
    raise refusal(
        f"found {str(value)[:60]}, a number of seeds from 1 to {MOST_SEEDS} or a list of seeds in "
        f"[0, {LARGEST_SEED}] is expected"
    )


def _changed(spec: Specification, changes: Sequence[Argument]) -> Specification:
    """The sweep with the command line's values in place of those that the file has for the same keys."""
    grid, fixed = dict(spec.grid), {document.value[0]: document for document in spec.fixed}
    seeds = spec.seeds
    for change in changes:
        documents = [override(text) for text in change.texts]
        key = change.key
        if key in ("seeds", "seed"):
            # `seeds=20` is a number of them, `seed=3` is one, and `seeds=1,2` and `seed=1,2` are these.
            values = [document.value[1] for document in documents]
            value = values[0] if key == "seeds" and len(values) == 1 else values
            seeds = _seeds(value, lambda what, change=change: InputError(f"override '{change.text}': {what}"))
            continue
        check_key(key, f"override '{change.text}'")
        grid.pop(key, None)
        fixed.pop(key, None)
        if len(documents) == 1:
            fixed[key] = documents[0]
        else:
            grid[key] = tuple(documents)
    values = {**spec.__dict__, "grid": grid, "fixed": tuple(fixed.values()), "seeds": seeds}
    return Specification(**values)


def _refuse_twice(spec: Specification) -> None:
    places = {
        "set": {document.value[0] for document in spec.fixed},
        "list": {document.value[0] for entry in spec.listed for document in entry},
        "random": set(spec.draws.keys) if spec.draws else set(),
        "grid": set(spec.grid),
        "seeds": {"seed"} if spec.seeds else set(),
    }
    seen: dict[str, str] = {}
    for place, keys in places.items():
        for key in sorted(keys):
            if key in seen:
                raise InputError(
                    f"{spec.source}: '{key}' is given in '{seen[key]}' and in '{place}', keep one"
                )
            seen[key] = place
