"""YAML text to plain values, with the line of every key, for text that nobody has vouched for.

Only plain data is built (as yaml.safe_load does): no tags, no objects, no merge keys, no `${...}`. Depth and
number of values are bounded while composing, aliases counted as often as they are used, so that no small file
grows into a large one. Numbers are read as people write them: `1e-3` is one; `12:30`, `010`, dates are text.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from jffsr.errors import InputError

MAX_BYTES = 1_000_000
MAX_DEPTH = 30
MAX_VALUES = 20_000
MAX_KEY = 60

Key = tuple[str, ...]


@dataclass(frozen=True)
class Mark:
    """Where a value was written: a file or an override, the line in a file, and its text if a scalar."""

    source: str
    line: int | None
    text: str | None = None

    @property
    def place(self) -> str:
        return self.source if self.line is None else f"{self.source}:{self.line}"


@dataclass(frozen=True)
class Document:
    """The plain value of one YAML text and the mark of every key in it (list entries count from 0)."""

    value: Any
    marks: dict[Key, Mark]


_INT = re.compile(r"[-+]?(?:0|[1-9][0-9]*(?:_[0-9]+)*)\Z")
_FLOAT = re.compile(
    r"(?:[-+]?(?:[0-9]+\.[0-9]*|\.[0-9]+|[0-9]+(?=[eE]))(?:[eE][-+]?[0-9]+)?"
    r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))\Z"
)
_BOOL = re.compile(r"(?:yes|Yes|YES|no|No|NO|true|True|TRUE|false|False|FALSE|on|On|ON|off|Off|OFF)\Z")
_NULL = re.compile(r"(?:~|null|Null|NULL|)\Z")
_TAG = "tag:yaml.org,2002:"
_PLAIN_TAGS = {_TAG + name for name in ("bool", "int", "float", "null", "str", "seq", "map")}


class _Loader(yaml.SafeLoader):
    """Composes nodes under bounds; never constructs anything but the values of `_scalar`."""

    yaml_implicit_resolvers: dict = {}  # noqa: RUF012 - PyYAML's own way to give a loader its resolvers

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.depth = 0
        self.values = 0

    def compose_node(self, parent, index):
        self.depth += 1
        self.values += 1
        line = self.peek_event().start_mark.line + 1
        if self.depth > MAX_DEPTH:
            raise _Refused(line, f"nested more than {MAX_DEPTH} levels deep")
        if self.values > 2 * MAX_VALUES:  # keys are nodes as well
            raise _Refused(line, f"more than {MAX_VALUES} values")
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node


_Loader.add_implicit_resolver(_TAG + "bool", _BOOL, list("yYnNtTfFoO"))
_Loader.add_implicit_resolver(_TAG + "int", _INT, list("-+0123456789"))
_Loader.add_implicit_resolver(_TAG + "float", _FLOAT, list("-+0123456789."))
_Loader.add_implicit_resolver(_TAG + "null", _NULL, ["~", "n", "N", ""])
_Loader.add_implicit_resolver(_TAG + "merge", re.compile(r"<<\Z"), ["<"])


class _Refused(Exception):
    def __init__(self, line: int, what: str) -> None:
        super().__init__(what)
        self.line, self.what = line, what


def read_text(path: Path, shown: str) -> str:
    """The UTF-8 text of a regular file of at most MAX_BYTES, `shown` in messages; raises InputError."""
    try:
        # Opened first, and without waiting, so that a pipe or a device is refused and never read.
        with open(os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0)), "rb") as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise InputError(f"{shown}: this is not a regular file, a YAML file is expected")
            data = file.read(MAX_BYTES + 1)
    except InputError:
        raise
    except IsADirectoryError:
        raise InputError(f"{shown}: this is a folder, a YAML file is expected") from None
    except FileNotFoundError:
        raise InputError(f"{shown}: there is no such file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{shown!r}: the file cannot be read ({reason.lower()})") from None
    if len(data) > MAX_BYTES:
        raise InputError(f"{shown}: the file is larger than {MAX_BYTES:,} bytes, the most that is read")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        byte = f"0x{data[error.start]:02x}"
        raise InputError(f"{shown}:{line}: the file is not UTF-8 text (byte {byte})") from None


def parse(text: str, source: str, prefix: Key = (), with_lines: bool = True) -> Document:
    """The value of one YAML text, its marks under `prefix`; raises InputError with `source` and the line."""

    def mark(line: int, scalar: str | None = None) -> Mark:
        return Mark(source, line if with_lines else None, scalar)

    try:
        loader = _Loader(text)
        try:
            node = loader.get_single_node()
        finally:
            loader.dispose()
        marks: dict[Key, Mark] = {}
        value = None if node is None else _Builder(marks, mark).build(node, prefix)
        return Document(value, marks)
    except _Refused as error:
        line, what = error.line, error.what
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        what = f"the character U+{ord(text[error.position]):04X} is not allowed in YAML"
    except yaml.composer.ComposerError as error:
        line = _line_of(error)
        one = "expected a single document" in (error.context or "")
        what = "a second document begins here, one is expected" if one else f"not valid YAML: {error.problem}"
    except yaml.MarkedYAMLError as error:
        line, problem = _line_of(error), error.problem or error.context or ""
        what = f"not valid YAML: {' '.join(problem.split())[:200]}"
        if r"'\t'" in what:
            what += " (indent with spaces, not tabs)"
    raise InputError(f"{mark(line).place}: {what}") from None


def _line_of(error: yaml.MarkedYAMLError) -> int:
    where = error.problem_mark or error.context_mark
    return where.line + 1 if where else 1


class _Builder:
    """Turns composed nodes into plain values and marks; an alias is built and counted wherever it is used."""

    def __init__(self, marks: dict[Key, Mark], mark: Callable[..., Mark]) -> None:
        self.marks, self.mark, self.count = marks, mark, 0

    def build(self, node: yaml.Node, key: Key, line: int | None = None) -> Any:
        line = node.start_mark.line + 1 if line is None else line
        self.count += 1
        if self.count > MAX_VALUES:
            raise _Refused(line, f"more than {MAX_VALUES} values")
        if len(key) > MAX_DEPTH:
            raise _Refused(line, f"nested more than {MAX_DEPTH} levels deep")
        if node.tag not in _PLAIN_TAGS:
            tag = node.tag.replace(_TAG, "!!")[:60]
            raise _Refused(line, f"the tag {tag!r} is not allowed, only plain values are")
        if isinstance(node, yaml.ScalarNode):
            self.marks[key] = self.mark(line, node.value)
            return _scalar(node, line)
        self.marks[key] = self.mark(line)
        if isinstance(node, yaml.SequenceNode):
            return [self.build(item, (*key, str(i))) for i, item in enumerate(node.value)]
        return self._mapping(node, key)

    def _mapping(self, node: yaml.MappingNode, key: Key) -> dict[str, Any]:
        result: dict[str, Any] = {}
        first: dict[str, int] = {}
        for name_node, item in node.value:
            line = name_node.start_mark.line + 1
            if name_node.tag == _TAG + "merge":
                raise _Refused(line, "merge keys '<<' are not read, a 'defaults' list builds on another file")
            name = name_node.value
            if name_node.tag != _TAG + "str" or not isinstance(name_node, yaml.ScalarNode):
                shown = repr(name[:60]) if isinstance(name_node, yaml.ScalarNode) else "a list or mapping"
                raise _Refused(line, f"found {shown} as a key, a key is text")
            if not name.isprintable() or not 0 < len(name) <= MAX_KEY:
                raise _Refused(line, f"found {name[:MAX_KEY]!r} as a key, a key is at most {MAX_KEY} letters")
            if name in result:
                dotted = ".".join((*key, name))
                raise _Refused(line, f"key '{dotted}' is given twice (first at line {first[name]})")
            first[name] = line
            result[name] = self.build(item, (*key, name), line)
        return result


def _scalar(node: yaml.ScalarNode, line: int) -> Any:
    text, kind = node.value, node.tag.removeprefix(_TAG)
    if kind == "str":
        if "${" in text or text == "???":
            found = repr(text[:60])
            raise _Refused(
                line, f"found {found}, but '${{...}}' and '???' mean nothing here, write the value"
            )
        return text
    # An explicit tag such as `!!int fast` may sit on any text, so the pattern is asked again.
    pattern = {"bool": _BOOL, "int": _INT, "float": _FLOAT, "null": _NULL}.get(kind)
    if pattern is None or not pattern.match(text):
        raise _Refused(line, f"found {text[:60]!r}, which is no {kind}")
    if kind == "null":
        return None
    if kind == "bool":
        return text.lower() in ("yes", "true", "on")
    if kind == "int":
        if len(text) > 400:
            raise _Refused(line, f"found a number of {len(text)} digits, at most 400 are read")
        return int(text)
    return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))
