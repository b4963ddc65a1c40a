"""The kinds of value that a configuration holds, each with the words that say what is expected.

Each function gives a pydantic validator to annotate a field with. Numbers are finite; true/false and quoted
numbers are not numbers; a number without a fraction (2e4) is a whole number.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Annotated, Any

from pydantic import BeforeValidator, Discriminator, PlainValidator, Tag
from pydantic_core import PydanticCustomError

from jffsr.reading.did_you_mean import hint, listed

# Tags of a union never show in a message; complaints.py drops whatever begins with this sign.
UNION_SIGN = "<"


def expected(what: str, advice: str = "") -> PydanticCustomError:
    """The error of a value of another kind or size: `found ..., WHAT is expected`."""
    return PydanticCustomError("expected", "{what}", {"what": what, "advice": advice})


def conflict(sentence: str, key: str = "") -> PydanticCustomError:
    """The error of values that do not go together, told at the key `key` of the section."""
    return PydanticCustomError("conflict", "{sentence}", {"sentence": sentence, "key": key})


def number(*, gt=None, ge=None, lt=None, le=None, unit: str = "", instead: str = "") -> PlainValidator:
    """A finite float within bounds; `instead` names what else the key takes."""
    phrase = "a number" + _interval(gt, ge, lt, le) + (f" {unit}" if unit else "") + instead

    def check(value: Any) -> float:
        result = _finite(value)
        if result is None or not _within(result, gt, ge, lt, le):
            raise expected(phrase)
        return result

    return PlainValidator(check)


def whole(low: int, high: int) -> PlainValidator:
    """An int in [low, high]."""
    phrase = "a whole number" + _interval(None, low, None, high)

    def check(value: Any) -> int:
        exact = isinstance(value, int) and not isinstance(value, bool)
        result = value if exact else _finite(value)
        if result is None or result != math.floor(result) or not low <= result <= high:
            raise expected(phrase)
        return int(result)

    return PlainValidator(check)


def flag() -> PlainValidator:
    """A bool."""

    def check(value: Any) -> bool:
        if not isinstance(value, bool):
            raise expected("true or false")
        return value

    return PlainValidator(check)


def text(pattern: str, phrase: str) -> PlainValidator:
    """A str of printable characters that the pattern matches as a whole."""

    def check(value: Any) -> str:
        if not isinstance(value, str) or not value.isprintable() or not re.fullmatch(pattern, value):
            raise expected(phrase)
        return value

    return PlainValidator(check)


def choice(*names: str) -> PlainValidator:
    """One of a few names."""
    phrase = listed(f"'{name}'" for name in names)

    def check(value: Any) -> str:
        if not isinstance(value, str):
            raise expected(phrase)
        if value not in names:
            raise expected(phrase, hint(value, names))
        return value

    return PlainValidator(check)


def sequence(phrase: str, low: int, high: int) -> BeforeValidator:
    """A list of `low` to `high` entries, its entries left to the field's own type."""

    def check(value: Any) -> tuple:
        if not isinstance(value, list | tuple) or not low <= len(value) <= high:
            raise expected(phrase)
        return tuple(value)

    return BeforeValidator(check)


def mapping(of: str) -> PlainValidator:
    """A mapping of names to plain values, which its user checks."""

    def check(value: Any) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise expected(f"a mapping of {of}")
        return dict(value)

    return PlainValidator(check)


def either(one: Any, many: Any, is_many: Callable[[Any], bool]) -> Any:
    """The type of a key of two forms, told apart by `is_many` so that an error speaks of the form used."""
    first, second = UNION_SIGN + "one", UNION_SIGN + "many"
    return Annotated[
        Annotated[one, Tag(first)] | Annotated[many, Tag(second)],
        Discriminator(lambda value: second if is_many(value) else first),
    ]


def _finite(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        result = float(value)
    except OverflowError:
        return None
    return result if math.isfinite(result) else None


def _within(value: float, gt, ge, lt, le) -> bool:
    return (
        (gt is None or value > gt)
        and (ge is None or value >= ge)
        and (lt is None or value < lt)
        and (le is None or value <= le)
    )


def _interval(gt, ge, lt, le) -> str:
    low, high = (gt if ge is None else ge), (lt if le is None else le)
    if low is None and high is None:
        return ""
    if high is None:
        return f" {'>=' if gt is None else '>'} {_short(low)}"
    if low is None:
        return f" {'<=' if lt is None else '<'} {_short(high)}"
    return f" in {'(' if ge is None else '['}{_short(low)}, {_short(high)}{')' if le is None else ']'}"


def _short(bound: float) -> str:
    if isinstance(bound, int) and abs(bound) <= 10**5:
        return str(bound)
    for_people = re.sub(r"e\+?(-?)0*", r"e\1", f"{bound:g}")
    return for_people if float(for_people) == bound else str(bound)
