"""What a watched folder says at one moment: sentences, numbers and curves, with nothing of a viewer in it."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jffsr.errors import InputError
from jffsr.study.run_folder import RunFolder
from jffsr.study.sweep.folder import SweepFolder

_PLACES = 600


@dataclass(frozen=True)
class Chart:
    """Curves by name over x (k,), all finite; `logarithmic` where all are positive and differ."""

    title: str
    x_label: str
    x: np.ndarray
    curves: dict[str, np.ndarray]

    @property
    def logarithmic(self) -> bool:
        """Whether a logarithmic axis shows more than a linear one."""
        values = np.concatenate(list(self.curves.values()))
        return bool(values.size and values.min() > 0 and values.max() > 1.5 * values.min())


@dataclass(frozen=True)
class Table:
    """Rows of words under a head, of which `left_out` more are not shown."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    left_out: int = 0


@dataclass(frozen=True)
class News:
    """headline: how it stands, in one sentence; facts: what and how much; share: done, in [0, 1], None if unknown.

    hint is the command that shows what is finished.
    """

    headline: str
    finished: bool
    facts: tuple[tuple[str, str], ...]
    charts: tuple[Chart, ...] = ()
    table: Table | None = None
    share: float | None = None
    hint: str = ""


def curve(title: str, x_label: str, name: str, x, y) -> Chart | None:
    """A chart of one curve where it is finite, at no more than 600 places; None where it nowhere is."""
    x, y = np.asarray(x, float), np.asarray(y, float)
    kept = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    if not kept.size:
        return None
    if kept.size > _PLACES:
        kept = kept[np.linspace(0, kept.size - 1, _PLACES).round().astype(int)]
    return Chart(title, x_label, x[kept], {name: y[kept]})


def ending(folder: RunFolder | SweepFolder) -> str:
    """How a finished run or sweep ended, in one sentence."""
    try:
        return f"finished: {folder.read_summary()['result']['sentence']}"
    except (InputError, KeyError, TypeError):
        return "finished"


def changed_at(*paths: Path) -> float | None:
    """When the latest of the files was last written, s since the epoch; None where there is none."""
    found = []
    for path in paths:
        try:
            found.append(path.stat().st_mtime)
        except OSError:
            continue
    return max(found, default=None)


def ago(instant: float | None, now: float | None = None) -> str:
    """How long ago an instant was, in words."""
    if instant is None:
        return "not yet"
    return f"{lasting((time.time() if now is None else now) - instant)} ago"


def lasting(seconds: float) -> str:
    """A length of time in its two largest units: 42 s, 3 min 5 s, 2 h 0 min, 3 d 4 h."""
    left = max(int(seconds), 0)
    units = (("d", 86400), ("h", 3600), ("min", 60), ("s", 1))
    first = next((i for i, (_, size) in enumerate(units) if left >= size), len(units) - 1)
    words = []
    for name, size in units[first : first + 2]:
        count, left = divmod(left, size)
        words.append(f"{count} {name}")
    return " ".join(words)
