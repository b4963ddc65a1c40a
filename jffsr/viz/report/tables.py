"""Numbers of a run's summary as tables of a page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import Any

_UNITS = {
    "_rad": "rad",
    "_m": "m",
    "_deg": "deg",
    "_kg": "kg",
    "_relative": "relative",
}
_LONGEST = 12
"""Numbers of a list that a cell shows."""


def table(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A table; numbers stand to the right, what is None is left empty."""
    if not rows:
        return ""
    top = "".join(f"<th>{escape(str(cell))}</th>" for cell in head)
    body = "\n".join("<tr>" + "".join(map(_cell, row)) + "</tr>" for row in rows)
    top = f"<thead><tr>{top}</tr></thead>" if any(head) else ""
    return f'<div class="wide"><table>{top}<tbody>\n{body}\n</tbody></table></div>'


def number(value: Any) -> str:
    """A value as a reader wants it: numbers to four digits, lists with commas, None as nothing."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, (list, tuple)):
        shown = [number(part) or "–" for part in value[:_LONGEST]]
        return ", ".join([*shown, "..."] if len(value) > _LONGEST else shown)
    return str(value)


def flattened(values: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Keys and values of a tree of mappings, a key's way down to it written out; empty branches are left out."""
    for key, value in values.items():
        name = f"{before}{key}"
        if isinstance(value, Mapping):
            yield from flattened(value, f"{name}, ")
        elif value not in (None, [], ""):
            yield name, value


def measured(values: Mapping[str, Any]) -> str:
    """A table of named numbers, their units read off the names' endings."""
    rows = [(*_with_unit(name), value) for name, value in flattened(values)]
    return table(("", "", ""), [(name, value, unit) for name, unit, value in rows])


def terms_table(terms: Mapping[str, Any], finer: Mapping[str, Any]) -> str:
    """Every term of an objective by name: value, weighted, and weighted at the finer re-run."""
    rows = [
        (name.replace("_", " "), term["value"], term["weighted"], finer.get(name, {}).get("weighted"))
        for name, term in terms.items()
    ]
    if all(row[3] is None for row in rows):
        return table(("term", "value", "weighted"), [row[:3] for row in rows])
    return table(("term", "value", "weighted", "weighted, finer re-run"), rows)


def compared(parts: Mapping[str, Mapping[str, Any]]) -> str:
    """A row for each of several things that a run compares, a column for each plain value that they all have."""
    flat = {name: {"verdict": _sentence(part), **_plain(part)} for name, part in parts.items()}
    first = next(iter(flat.values()), {})
    columns = [key for key in first if all(key in part for part in flat.values())]
    columns = [key for key in columns if any(part[key] not in (None, "") for part in flat.values())]
    rows = [(name, *(part[key] for key in columns)) for name, part in flat.items()]
    return table(("", *(key.replace("_", " ") for key in columns)), rows)


def _sentence(part: Mapping[str, Any]) -> str | None:
    return part.get("sentence") or (part.get("result") or {}).get("sentence")


def _plain(part: Mapping[str, Any]) -> dict[str, Any]:
    found = {
        key: value
        for key, value in part.items()
        if isinstance(value, (int, float, str)) and key != "sentence"
    }
    for key in ("pose_errors",):
        found |= part.get(key, {})
    return found


def _with_unit(name: str) -> tuple[str, str]:
    for ending, unit in _UNITS.items():
        if name.endswith(ending):
            return name.removesuffix(ending).replace("_", " "), unit
    return name.replace("_", " "), ""


def _cell(value: Any) -> str:
    kind = ' class="number"' if isinstance(value, (int, float)) and not isinstance(value, bool) else ""
    return f"<td{kind}>{escape(number(value))}</td>"
