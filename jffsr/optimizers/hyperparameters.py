"""Hyperparameters as dataclass fields that say what is allowed, so that options can be checked by name.

Importing this needs no JAX: the fields' bounds are plain numbers in their metadata.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, field, fields
from typing import Any

from jffsr.errors import InputError
from jffsr.reading.did_you_mean import hint, listed

Option = float | int | str | bool
"""What an option may be."""

_KEY = "option"


class OptionError(InputError):
    """An option that an optimizer does not take; `option` is its name."""

    def __init__(self, option: str, sentence: str):
        super().__init__(f"options.{option}: {sentence}")
        self.option, self.sentence = option, sentence


def number(default: float, low: float = -math.inf, high: float = math.inf, *, inside: bool = False) -> Any:
    """A traced number in [low, high], or in (low, high) where it must lie inside."""
    bounds = _interval(low, high, inside)

    def read(value: Any) -> float | None:
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            return None
        within = low < value < high if inside else low <= value <= high
        return float(value) if within else None

    return field(default=default, metadata={_KEY: (read, f"a number{bounds}", ())})


def size(default: int, low: int, high: int) -> Any:
    """A static whole number in [low, high]."""

    def read(value: Any) -> int | None:
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            return None
        return int(value) if value == int(value) else None

    phrase = f"a whole number in [{low}, {high}]"
    return field(default=default, metadata={"static": True, _KEY: (read, phrase, ())})


def choice(default: str, *names: str) -> Any:
    """A static name, one of a few."""
    phrase = listed(f"'{name}'" for name in names)
    read = {name: name for name in names}
    return field(
        default=default,
        metadata={
            "static": True,
            _KEY: (lambda value: read.get(value) if isinstance(value, str) else None, phrase, names),
        },
    )


def flag(default: bool) -> Any:
    """A static true or false."""
    read = (lambda value: value if isinstance(value, bool) else None, "true or false", ())
    return field(default=default, metadata={"static": True, _KEY: read})


def option_fields(algorithm: type) -> dict[str, Field]:
    """The fields of an algorithm's dataclass that may be given as options."""
    return {f.name: f for f in fields(algorithm) if _KEY in f.metadata}


def read_options(known: Mapping[str, Field], given: Mapping[str, Any]) -> dict[str, Option]:
    """The given options as the fields want them; OptionError names the first that is wrong and what is right."""
    found = {}
    for name, value in given.items():
        if name not in known:
            near = hint(str(name), known) or f"; the options here are {', '.join(known) or 'none'}"
            raise OptionError(str(name), f"unknown option{near}")
        read, phrase, names = known[name].metadata[_KEY]
        result = read(value)
        if result is None:
            near = hint(value, names) if isinstance(value, str) else ""
            raise OptionError(name, f"found {_shown(value)}, {phrase} is expected{near}")
        found[name] = result
    return found


def defaults(known: Mapping[str, Field]) -> dict[str, Option]:
    """What each option is where it is not given."""
    return {name: f.default for name, f in known.items() if f.default is not MISSING}


def _shown(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if value is None:
        return "null"
    return (
        (f"'{value[:60]}'" if value.isprintable() else repr(value[:60]))
        if isinstance(value, str)
        else str(value)[:60]
    )


def _interval(low: float, high: float, inside: bool) -> str:
    if low == -math.inf and high == math.inf:
        return ""
    if high == math.inf:
        return f" {'>' if inside else '>='} {low:.4g}"
    open_, close = "()" if inside else "[]"
    return f" in {open_}{low:.4g}, {high:.4g}{close}"


Reader = Callable[[Any], Option | None]
