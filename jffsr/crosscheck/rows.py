"""What all reports of comparisons share: rows as a table of text, and numbers as JSON takes them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """The rows as lines, columns two spaces apart, the first to the left and the others to the right."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    lines = []
    for row in rows:
        first, *others = (text.rjust(width) for text, width in zip(row, widths, strict=True))
        lines.append("  ".join([first.strip().ljust(widths[0]), *others]))
    return lines


def finite_or_none(value: Any) -> Any:
    """The value, but None for a float that JSON has no word for."""
    return None if isinstance(value, float) and not math.isfinite(value) else value
