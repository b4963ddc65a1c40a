"""The values of the command line, key=v1,v2."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from jffsr.errors import InputError

_OPEN, _CLOSE = "[{(", "]})"


class Argument(NamedTuple):
    """One argument: its text, its key, and a text `key=value` for each of its values."""

    text: str
    key: str
    texts: tuple[str, ...]


def read_arguments(arguments: Sequence[str]) -> list[Argument]:
    """The arguments, their values told apart; raises InputError."""
    found: dict[str, Argument] = {}
    for text in arguments:
        key, equals, values = text.partition("=")
        key = key.strip()
        if not equals or not key:
            raise InputError(
                f"override '{text[:80]}': key=v1,v2 is expected, such as optimizer.particles=32,64"
            )
        if key in found:
            raise InputError(f"override '{text[:80]}': '{key}' is given twice")
        parts = split_values(values)
        if any(not part for part in parts):
            raise InputError(f"override '{text[:80]}': a value is empty, write null where that is meant")
        found[key] = Argument(text[:80], key, tuple(f"{key}={part}" for part in parts))
    return list(found.values())


def split_values(text: str) -> list[str]:
    """The parts between commas that stand in no bracket and no quotes."""
    parts, depth, quote = [""], 0, ""
    for letter in text:
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "'\"":
            quote = letter
        elif letter in _OPEN:
            depth += 1
        elif letter in _CLOSE:
            depth -= 1
        elif letter == "," and depth == 0:
            parts.append("")
            continue
        parts[-1] += letter
    return [part.strip() for part in parts]
