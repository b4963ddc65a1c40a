"""YAML text to plain values, with the line of every key, for text that nobody has vouched for.

Only plain data is built (as yaml.safe_load does): no tags, no objects, no merge keys, no `${...}`. Depth and
number of values are bounded while composing, aliases counted as often as they are used, so that no small file
grows into a large one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import yaml

from jffsr.errors import InputError
from jffsr.reading.yaml_loader import MAX_DEPTH, MAX_VALUES, PLAIN_TAGS, TAG, Loader, Refused, scalar

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


def parse(text: str, source: str, prefix: Key = (), with_lines: bool = True) -> Document:
    """The value of one YAML text, its marks under `prefix`; raises InputError with `source` and the line."""

    def mark(line: int, scalar: str | None = None) -> Mark:
        return Mark(source, line if with_lines else None, scalar)

    try:
        loader = Loader(text)
        try:
            node = loader.get_single_node()
        finally:
            loader.dispose()
        marks: dict[Key, Mark] = {}
        value = None if node is None else _Builder(marks, mark).build(node, prefix)
        return Document(value, marks)
    except Refused as error:
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
            raise Refused(line, f"more than {MAX_VALUES} values")
        if len(key) > MAX_DEPTH:
            raise Refused(line, f"nested more than {MAX_DEPTH} levels deep")
        if node.tag not in PLAIN_TAGS:
            tag = node.tag.replace(TAG, "!!")[:60]
            raise Refused(line, f"the tag {tag!r} is not allowed, only plain values are")
        if isinstance(node, yaml.ScalarNode):
            self.marks[key] = self.mark(line, node.value)
            return scalar(node, line)
        self.marks[key] = self.mark(line)
        if isinstance(node, yaml.SequenceNode):
            return [self.build(item, (*key, str(i))) for i, item in enumerate(node.value)]
        return self._mapping(node, key)

    def _mapping(self, node: yaml.MappingNode, key: Key) -> dict[str, Any]:
        result: dict[str, Any] = {}
        first: dict[str, int] = {}
        for name_node, item in node.value:
            line = name_node.start_mark.line + 1
            if name_node.tag == TAG + "merge":
                raise Refused(line, "merge keys '<<' are not read, a 'defaults' list builds on another file")
            name = name_node.value
            if name_node.tag != TAG + "str" or not isinstance(name_node, yaml.ScalarNode):
                shown = repr(name[:60]) if isinstance(name_node, yaml.ScalarNode) else "a list or mapping"
                raise Refused(line, f"found {shown} as a key, a key is text")
            if not name.isprintable() or not 0 < len(name) <= MAX_KEY:
                raise Refused(line, f"found {name[:MAX_KEY]!r} as a key, a key is at most {MAX_KEY} letters")
            if name in result:
                dotted = ".".join((*key, name))
                raise Refused(line, f"key '{dotted}' is given twice (first at line {first[name]})")
            first[name] = line
            result[name] = self.build(item, (*key, name), line)
        return result
