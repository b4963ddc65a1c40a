"""The keys of a configuration as its models have them: what may stand under each, and what stands there by default."""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import dataclass
from typing import Annotated, Any, get_args, get_origin

from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

REQUIRED = "required"


@dataclass(frozen=True)
class Entry:
    """A key of a section: its default as YAML, what is allowed there, and the section that stands under it.

    `section` is None for a plain value; `inline` tells one section from a list or mapping of several.
    """

    key: str
    default: str
    allowed: str
    section: type[BaseModel] | None
    inline: bool


def entries(model: type[BaseModel]) -> list[Entry]:
    """The keys of a section in their order; `x_deg` and `x` are one entry, named `x_deg, x`."""
    fields, written, asked = model.model_fields, _written(model), _asked(model)
    twins = {key for key in fields if f"{key}_deg" in fields}
    found = []
    for name, info in fields.items():
        plain = name.removesuffix("_deg")
        if plain not in twins:
            section = _section(info.annotation)
            one = section is not None and not _is_many(info.annotation)
            found.append(Entry(name, _default(info), _allowed(info), section, one))
        elif f"{plain}_deg, {plain}" not in [entry.key for entry in found]:
            pair = (f"{plain}_deg", plain)
            given = [f"{key}: {as_yaml(written[key])}" for key in pair if written.get(key) is not None]
            phrases = dict.fromkeys(_allowed(fields[key]) for key in pair)
            default = REQUIRED if plain in asked else given[0] if given else "null"
            allowed = "; ".join(phrases)
            if default == REQUIRED:
                allowed = allowed.removesuffix(" or null")
            found.append(Entry(", ".join(pair), default, allowed, None, False))
    return found


def as_yaml(value: Any) -> str:
    """A default as a person writes it; a section is `{}`, whose keys have defaults of their own."""
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, BaseModel):
        assert value == type(value).model_validate({}), "the default of a section is that of its keys"
        return "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(as_yaml, value))}]"
    return re.sub(r"e\+?(-?)0*", r"e\1", f"{value:g}") if isinstance(value, float) else str(value)


def _default(info: FieldInfo) -> str:
    return REQUIRED if info.is_required() else as_yaml(info.get_default(call_default_factory=True))


def _written(model: type[BaseModel]) -> dict[str, Any]:
    """What a section writes of itself where nothing is given."""
    try:
        return dict(model.model_validate({}))
    except ValidationError as error:
        return error.errors()[0]["input"] or {}


def _asked(model: type[BaseModel]) -> set[str]:
    """The quantities in two units of which a section's own check asks for one."""
    asked: set[str] = set()
    if not getattr(model, "units", ()):
        return asked

    class Recorded(model):
        def check_units(self, *required: str) -> None:
            asked.update(required)

    nothing = Recorded.model_construct(**dict.fromkeys(model.model_fields))
    for check in model.__pydantic_decorators__.model_validators.values():
        # What else it looks at is not there.
        with suppress(AttributeError, TypeError, PydanticCustomError):
            if check.info.mode == "after":
                check.func(nothing)
    return asked


class _Nothing:
    """What no key takes."""


def _allowed(info: FieldInfo) -> str:
    """The words in which a wrong value is refused."""
    parts = get_args(info.annotation)
    null = type(None) in parts
    kept = next(part for part in parts if part is not type(None)) if null else info.annotation
    for metadata in info.metadata:
        kept = Annotated[kept, metadata]
    phrase = _phrase(kept)
    if not null or phrase.endswith("null"):
        return phrase
    if phrase.startswith(("'", "true", "a number")):
        phrase = ", ".join(phrase.rsplit(" or ", 1))
    return f"{phrase} or null"


def _phrase(annotation: Any) -> str:
    if annotation is bool:
        return "true or false"
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return "a mapping"
    if get_origin(annotation) is dict:
        key, value = get_args(annotation)
        return f"a mapping of {_phrase(key)} to {_phrase(value)}"
    try:
        TypeAdapter(annotation).validate_python(_Nothing())
    except ValidationError as error:
        return error.errors()[0]["ctx"]["what"].removesuffix(",")
    raise AssertionError(f"{annotation} takes anything")


def _section(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next(filter(None, map(_section, get_args(annotation))), None)


def _is_many(annotation: Any) -> bool:
    return get_origin(annotation) in (dict, tuple) or any(map(_is_many, get_args(annotation)))
