"""Files that are written whole or not at all."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from jffsr.writing import write_atomically


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically."""
    write_atomically(path, lambda part: part.write_text(text, encoding="utf-8"))


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file atomically."""
    write_atomically(path, lambda part: part.write_bytes(content))


def write_json(path: Path, value: Any) -> None:
    """Write JSON atomically; numbers that are not finite become null, which JSON has and NaN it has not."""
    write_text(path, json.dumps(plain(value), indent=2) + "\n")


def plain(value: Any) -> Any:
    """The value with arrays as lists, NumPy scalars as numbers, and what is not finite as None."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
