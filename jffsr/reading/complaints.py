"""What pydantic found wrong, as one sentence with the place, the key, what was found and what is expected."""

from __future__ import annotations

from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError

from jffsr.errors import InputError
from jffsr.reading.did_you_mean import nearest
from jffsr.reading.sources import Sources
from jffsr.reading.values import UNION_SIGN
from jffsr.reading.yaml_lines import Key, Mark

_WRONG_KEY = "[key]"  # with which pydantic marks a key, not the value, of a mapping


def complaint(error: ValidationError, model: type[BaseModel], sources: Sources) -> InputError:
    """The first error in the order of the files, and how many more there are."""
    problems = []
    for i, entry in enumerate(error.errors(include_url=False)):
        key = tuple(str(part) for part in entry["loc"] if not str(part).startswith((UNION_SIGN, _WRONG_KEY)))
        if entry["type"] == "conflict" and entry["ctx"]["key"]:
            key += tuple(entry["ctx"]["key"].split("."))
        missing = entry["type"] == "missing"
        # A key that is missing stands nowhere; a misspelt one, its likely cause, goes before it.
        problems.append(((missing, *sources.order(key), i), key, entry))
    problems.sort(key=lambda problem: problem[0])
    _, key, entry = problems[0]
    more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
    sentence = _sentence(entry, key, model, sources.mark(key))
    return InputError(f"{sources.where('.'.join(key))}: {sentence}{more}")


def _sentence(entry: dict[str, Any], key: Key, model: type[BaseModel], mark: Mark | None) -> str:
    kind, context = entry["type"], entry.get("ctx", {})
    if kind == "conflict":
        return context["sentence"]
    if kind == "extra_forbidden":
        return "unknown key" + _advice(key, model)
    if kind == "missing":
        return "missing, this key is required"
    found = _found(entry["input"], mark)
    if kind == "expected":
        return f"found {found}, {context['what']} is expected{context['advice']}"
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        section = _section(model, key)
        names = ", ".join(section.model_fields) if section else "keys"
        return f"found {found}, a mapping of {names} is expected"
    return f"found {found}, {entry['msg'][0].lower()}{entry['msg'][1:]}"


def _found(value: Any, mark: Mark | None) -> str:
    """The value as it was written, and how YAML reads it where that is not what it looks like."""
    written = mark.text if mark and mark.text is not None else None
    if value is None:
        return "nothing" if written == "" else "null"
    if isinstance(value, bool):
        plain = "true" if value else "false"
        as_read = (
            "" if written is None or written.lower() == plain else f"{written} (which YAML reads as {plain})"
        )
        return as_read or plain
    if isinstance(value, str):
        return f"'{value}'" if len(value) <= 60 and value.isprintable() else repr(value[:60])
    if isinstance(value, int | float):
        return (written if written is not None else repr(value))[:60]
    if isinstance(value, list | tuple):
        if len(value) <= 8 and all(isinstance(item, int | float) for item in value):
            return f"[{', '.join(str(item)[:20] for item in value)}]"
        return f"a list of {len(value)}"
    return "a mapping"


def _advice(key: Key, model: type[BaseModel]) -> str:
    section, name = _section(model, key[:-1]), key[-1]
    if section is None:
        return ""
    # The right name in the wrong section is likelier than a similar name in this one.
    elsewhere = [dotted for dotted in _all_keys(model) if dotted.rpartition(".")[2] == name]
    matches = elsewhere if len(elsewhere) == 1 else nearest(name, section.model_fields)
    if matches:
        return f"; did you mean '{matches[0]}'?"
    return f"; the keys here are {', '.join(section.model_fields)}"


def _section(model: type[BaseModel], key: Key) -> type[BaseModel] | None:
    """The section that the key leads to, through lists, unions and mappings of sections."""
    here: type[BaseModel] | None = model
    labelled = False
    for part in key:
        if here is None:
            return None
        if part.isdecimal() or labelled:
            labelled = False
            continue
        info = here.model_fields.get(part)
        labelled = info is not None and _is_mapping(info.annotation)
        here = _model_in(info.annotation) if info else None
    return here


def _is_mapping(annotation: Any) -> bool:
    return get_origin(annotation) is dict or any(map(_is_mapping, get_args(annotation)))


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next(filter(None, map(_model_in, get_args(annotation))), None)


def _all_keys(model: type[BaseModel], above: str = "") -> list[str]:
    keys = []
    for name, info in model.model_fields.items():
        keys.append(above + name)
        inner = _model_in(info.annotation)
        if inner is not None:
            keys += _all_keys(inner, f"{above}{name}.")
    return keys
