"""The tables of docs/reference as tests see them: their rows, and the sections whose keys they have to have."""

from __future__ import annotations

import re
from functools import cache

from configuration_keys import Entry, entries
from documentation import DOCS
from pydantic import BaseModel

from jffsr.robots.yaml_schema import RobotModel
from jffsr.study.config import KINDS
from jffsr.study.tracking.schema_tracker import TrackerChange

REFERENCE = DOCS / "reference"
ROOTS = {f"{kind}.md": model for kind, model in KINDS.items()} | {"robot_file.md": RobotModel}
FROM_FILE = "the file's name"

Row = tuple[str, str, str, str]
"""Key, default, allowed and meaning; a key of two units is `x_deg, x`."""
Place = tuple[str, str]
"""A page, and the anchor of a heading on it; an empty one is the page's own."""


def plain(cell: str) -> str:
    """A cell without the signs that only set it off."""
    return re.sub(r"[`']", "", cell).strip()


def tables_in(text: str) -> dict[str, list[Row]]:
    """The tables of keys by the anchors of the headings that they stand under."""
    found: dict[str, list[Row]] = {}
    anchor, inside = "", False
    for line in text.splitlines():
        if heading := re.match(r"##+ (.+)", line):
            anchor = re.sub(r"[^\w\- ]", "", heading[1].lower()).replace(" ", "-")
        inside = line.startswith("|") and (inside or line == "| key | default | allowed | meaning |")
        if inside and line.startswith("| `"):
            key, default, allowed, meaning = line.strip("| ").split(" | ")
            found.setdefault(anchor, []).append(
                (plain(key), default if default == FROM_FILE else plain(default), plain(allowed), meaning)
            )
    return found


@cache
def tables(page: str) -> dict[str, list[Row]]:
    """The tables of a page."""
    return tables_in((REFERENCE / page).read_text(encoding="utf-8"))


def followed(meaning: str, page: str) -> Place | None:
    """Where a row says that the keys of its section are told."""
    link = re.search(r"\]\((\w+\.md)?#([\w-]+)\)", meaning)
    return link and (link[1] or page, link[2])


def walked(model: type[BaseModel], place: Place, rows: list[Row], above: str = ""):
    """(dotted key, entry, place of its section's own table) of all keys that the table has to have."""
    by_key = {row[0]: row for row in rows}
    for entry in entries(model):
        dotted = above + entry.key
        there = followed(by_key[dotted][3], place[0]) if entry.section and dotted in by_key else None
        if entry.section is None or dotted in by_key or entry.default == "null" or not entry.inline:
            yield dotted, entry, there
        if entry.section is not None and there is None and entry.inline:
            yield from walked(entry.section, place, rows, f"{dotted}.")


@cache
def places() -> dict[Place, list[type[BaseModel]]]:
    """Every table that can be come to from the page of a kind, and the sections that it is the table of."""
    found: dict[Place, list[type[BaseModel]]] = {}
    open_ = [((page, ""), model) for page, model in ROOTS.items()]
    while open_:
        place, model = open_.pop()
        if model in found.setdefault(place, []):
            continue
        found[place].append(model)
        for _, entry, there in walked(model, place, tables(place[0]).get(place[1], [])):
            if there is not None:
                open_.append((there, entry.section))
    return found


def entries_of(place: Place) -> dict[str, list[Entry]]:
    """What the sections of a table have under each key."""
    found: dict[str, list[Entry]] = {}
    for model in places()[place]:
        for dotted, entry, _ in walked(model, place, tables(place[0]).get(place[1], [])):
            # Of the trackers that are compared only what changes is given, so that nothing is by default.
            found.setdefault(dotted, []).extend([] if model is TrackerChange else [entry])
    return found
