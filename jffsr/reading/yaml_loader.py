"""A YAML loader under bounds, and the plain values of scalars as people write them.

`1e-3` is a number; `12:30`, `010` and dates are text. No tag builds an object.
"""

from __future__ import annotations

import re
from typing import Any

import yaml

MAX_DEPTH = 30
MAX_VALUES = 20_000


class Refused(Exception):
    """What is not accepted, and its line."""

    def __init__(self, line: int, what: str) -> None:
        super().__init__(what)
        self.line, self.what = line, what


_INT = re.compile(r"[-+]?(?:0|[1-9][0-9]*(?:_[0-9]+)*)\Z")
_FLOAT = re.compile(
    r"(?:[-+]?(?:[0-9]+\.[0-9]*|\.[0-9]+|[0-9]+(?=[eE]))(?:[eE][-+]?[0-9]+)?"
    r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))\Z"
)
_BOOL = re.compile(r"(?:yes|Yes|YES|no|No|NO|true|True|TRUE|false|False|FALSE|on|On|ON|off|Off|OFF)\Z")
_NULL = re.compile(r"(?:~|null|Null|NULL|)\Z")
TAG = "tag:yaml.org,2002:"
PLAIN_TAGS = {TAG + name for name in ("bool", "int", "float", "null", "str", "seq", "map")}


class Loader(yaml.SafeLoader):
    """Composes nodes under bounds; never constructs anything but the values of `scalar`."""

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
            raise Refused(line, f"nested more than {MAX_DEPTH} levels deep")
        if self.values > 2 * MAX_VALUES:  # keys are nodes as well
            raise Refused(line, f"more than {MAX_VALUES} values")
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node


Loader.add_implicit_resolver(TAG + "bool", _BOOL, list("yYnNtTfFoO"))
Loader.add_implicit_resolver(TAG + "int", _INT, list("-+0123456789"))
Loader.add_implicit_resolver(TAG + "float", _FLOAT, list("-+0123456789."))
Loader.add_implicit_resolver(TAG + "null", _NULL, ["~", "n", "N", ""])
Loader.add_implicit_resolver(TAG + "merge", re.compile(r"<<\Z"), ["<"])


def scalar(node: yaml.ScalarNode, line: int) -> Any:
    """The plain value of a scalar node; raises Refused."""
    text, kind = node.value, node.tag.removeprefix(TAG)
    if kind == "str":
        if "${" in text or text == "???":
            found = repr(text[:60])
            raise Refused(line, f"found {found}, but '${{...}}' and '???' mean nothing here, write the value")
        return text
    # An explicit tag such as `!!int fast` may sit on any text, so the pattern is asked again.
    pattern = {"bool": _BOOL, "int": _INT, "float": _FLOAT, "null": _NULL}.get(kind)
    if pattern is None or not pattern.match(text):
        raise Refused(line, f"found {text[:60]!r}, which is no {kind}")
    if kind == "null":
        return None
    if kind == "bool":
        return text.lower() in ("yes", "true", "on")
    if kind == "int":
        if len(text) > 400:
            raise Refused(line, f"found a number of {len(text)} digits, at most 400 are read")
        return int(text)
    return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))
