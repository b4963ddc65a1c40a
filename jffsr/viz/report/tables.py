"""Numbers of a run's summary as tables of a page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import Any

from jffsr.viz.report.units import NO_UNIT, name_and_unit, term_unit

_LONGEST = 12
"""Numbers of a list that a cell shows."""
_WORDS = 50
"""Letters from which on a cell is a sentence, which needs some width."""
OVERRUNS = "<p>A negative overrun is the share of a limit that is left.</p>"
_FINER = (
    "The planner works with the values at its own step; the last column has them from a re-run at a finer step, "
    "and by those the plan is judged."
)


def table(heads: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A table; numbers stand to the right, what is None is left empty."""
    if not rows:
        return ""
    top = "".join(f"<th>{escape(str(cell))}</th>" for cell in heads)
    body = "\n".join("<tr>" + "".join(map(_cell, row)) + "</tr>" for row in rows)
    top = f"<thead><tr>{top}</tr></thead>" if any(heads) else ""
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
    """Keys and values of a tree of mappings and of lists of them, a key's way down written with dots.

    Empty branches are left out.
    """
    for key, value in values.items():
        name = f"{before}{key}"
        if isinstance(value, (list, tuple)) and value and all(isinstance(part, Mapping) for part in value):
            value = {str(number): part for number, part in enumerate(value, 1)}
        if isinstance(value, Mapping):
            yield from flattened(value, f"{name}.")
        elif value not in (None, [], (), ""):
            yield name, value


def measured(values: Mapping[str, Any]) -> str:
    """A table of named numbers with their units; lists in which there is no number are left out."""
    rows = [
        (*name_and_unit(key), value)
        for key, value in flattened(values)
        if not (isinstance(value, (list, tuple)) and all(part is None for part in value))
    ]
    return table(("", "", "unit"), [(name, value, unit) for name, unit, value in rows])


def terms_table(
    terms: Mapping[str, Any], finer: Mapping[str, Any], scales: Mapping[str, str] | None = None
) -> str:
    """Every term of an objective by name: value and unit, weighted, and weighted at the finer re-run.

    scales says of a term which value counts 1, as a text with its unit.
    """
    scales = scales or {}
    columns = [
        ("term", [name.replace("_", " ") for name in terms]),
        ("value", [term["value"] for term in terms.values()]),
        ("unit", [term_unit(name, term) for name, term in terms.items()]),
        ("counts 1 at", [scales.get(name, NO_UNIT) for name in terms] if scales else []),
        ("weighted", [term["weighted"] for term in terms.values()]),
        ("weighted, finer re-run", [finer.get(name, {}).get("weighted") for name in terms]),
    ]
    columns = [(head, cells) for head, cells in columns if any(cell is not None for cell in cells)]
    heads, cells = zip(*columns, strict=True) if columns else ((), ())
    words = f"<p>{_FINER}</p>" if any(head.endswith("re-run") for head in heads) else ""
    return table(heads, list(zip(*cells, strict=True))) + words


def compared(parts: Mapping[str, Mapping[str, Any]]) -> str:
    """A row for each of several things that a run compares, a column for each plain value that they all have."""
    flat = {name: {"verdict": _sentence(part), **_plain(part)} for name, part in parts.items()}
    first = next(iter(flat.values()), {})
    columns = [key for key in first if all(key in part for part in flat.values())]
    columns = [key for key in columns if any(part[key] not in (None, "") for part in flat.values())]
    rows = [(name, *(part[key] for key in columns)) for name, part in flat.items()]
    return table(("", *map(head, columns)), rows)


def head(key: str) -> str:
    """A column's head: what it holds, with its unit where it has one."""
    name, unit = name_and_unit(key)
    return f"{name} [{unit}]" if unit else name


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


def _cell(value: Any) -> str:
    text = number(value)
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    kind = ' class="number"' if is_number else ' class="words"' if len(text) > _WORDS else ""
    return f"<td{kind}>{escape(text)}</td>"
