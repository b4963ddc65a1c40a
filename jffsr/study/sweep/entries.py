"""Looking into the plain values of a sweep's file, with the file and line of whatever is refused."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jffsr.errors import InputError
from jffsr.reading.did_you_mean import hint
from jffsr.reading.sources import Sources
from jffsr.reading.yaml_lines import Document, Key
from jffsr.study.composition import anchor_files

_DOTTED = re.compile(r"[A-Za-z_]\w*(\.\w+){0,20}", re.ASCII)
_NOT_SWEPT = ("kind", "name", "defaults")


def check_key(key: str, place: str) -> None:
    """Refuse what cannot be a key of a point."""
    if not _DOTTED.fullmatch(key):
        raise InputError(f"{place}: found '{key[:60]}', a dotted key such as optimizer.particles is expected")
    if key.split(".")[0] in _NOT_SWEPT:
        raise InputError(f"{place}: '{key}' is the same at every point of a sweep")


class Entries:
    """The mapping of a sweep's file."""

    def __init__(self, document: Document, folder: Path) -> None:
        self._values, self._folder = document.value, folder
        self.document_marks = document.marks
        self._sources = Sources((document.marks,), 0)

    def refusal(self, key: Key, sentence: str) -> InputError:
        """The error of what stands at a key."""
        mark = self._sources.mark(key)
        dotted = ".".join(key)
        place = f"{mark.place}: {dotted}" if mark else dotted
        return InputError(f"{place}: {sentence}")

    def has(self, *key: str) -> bool:
        """Whether something other than null stands at a key."""
        return self.value(*key) is not None

    def value(self, *key: str) -> Any:
        """What stands at a key; None where nothing does."""
        here = self._values
        for part in key:
            if isinstance(here, list):
                here = here[int(part)]
            else:
                here = here.get(part) if isinstance(here, dict) else None
        return here

    def keys_at(self, key: Key) -> list[str]:
        """The keys of a mapping, none where it is not given; refuses what is no mapping or empty."""
        value = self.value(*key)
        if value is None and len(key) == 1 and key[0] not in self._values:
            return []
        if not isinstance(value, dict) or not value:
            found = "an empty mapping" if value == {} else _kind(value)
            raise self.refusal(key, f"found {found}, a mapping of at least one key is expected")
        return list(value)

    def list_at(self, key: Key, of: str) -> list[Any]:
        """A list of at least one entry."""
        value = self.value(*key)
        if not isinstance(value, list) or not value:
            found = "an empty list" if value == [] else _kind(value)
            raise self.refusal(key, f"found {found}, a list of at least one is expected ({of})")
        return value

    def refuse_unknown(self, key: Key, known: Sequence[str]) -> None:
        """Refuse a mapping with a key that is not among these."""
        for name in self.value(*key):
            if name not in known:
                advice = hint(name, known) or f"; the keys here are {', '.join(known)}"
                raise self.refusal((*key, name), f"unknown key{advice}")

    def document(self, key: str, value: Any, place: Key) -> Document:
        """A point's value of a key, written at a place of the file."""
        mark = self._sources.mark(place)
        check_key(key, mark.place if mark else key)
        payload = {key: value}
        anchor_files(payload, self._folder)
        return Document((key, payload[key]), {tuple(key.split(".")): mark})


def _kind(value: Any) -> str:
    if value is None:
        return "nothing"
    return {dict: "a mapping", list: "a list"}.get(type(value), repr(value)[:60])
