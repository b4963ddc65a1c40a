"""Numbers and names out of XML attributes, and elements that nobody knows."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable

import numpy as np

from jffsr.errors import InputError
from jffsr.reading.did_you_mean import hint, listed, nearest
from jffsr.reading.xml_tree import Node

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(inf|infinity|nan)", re.IGNORECASE)
LARGEST = 1e30
"""No length, mass or moment is larger: its square must still be a number."""

MOST_BODIES = 1000
"""No robot has more links or bodies."""

_COUNTS = {1: "a number", 3: "three numbers", 4: "four numbers"}


def number(node: Node, attribute: str, place: str, default: float | None = None) -> float:
    """One finite number; `default`, where given, stands for an absent attribute."""
    if default is not None and attribute not in node.attributes:
        return default
    return float(numbers(node, attribute, 1, place)[0])


def numbers(
    node: Node, attribute: str, count: int, place: str, default: Iterable[float] | None = None
) -> np.ndarray:
    """`count` finite numbers of an attribute, apart by white space."""
    if attribute not in node.attributes:
        if default is not None:
            return np.array(default, dtype=float)
        known = [name for name in node.attributes]
        raise InputError(f"{place}: <{node.tag}> has no '{attribute}'{hint(attribute, known)}")
    text = node.attributes[attribute]
    words = text.split()
    if len(words) != count or not all(NUMBER.fullmatch(word) for word in words):
        raise InputError(f"{place}: <{node.tag}> {attribute} is {_short(text)}; {_COUNTS[count]} expected")
    values = np.array([float(word) for word in words])
    if not np.all(np.isfinite(values)):
        raise InputError(f"{place}: <{node.tag}> {attribute} {_short(text)} is not finite")
    if np.any(np.abs(values) > LARGEST):
        raise InputError(f"{place}: <{node.tag}> {attribute} {_short(text)} is out of all proportion")
    return values


def bound(node: Node, attribute: str, place: str) -> float:
    """A number that may be infinite: a limit. Beyond 1e300 it is: XML readers elsewhere do not know `inf`."""
    text = node.attributes[attribute].strip()
    if not NUMBER.fullmatch(text):
        raise InputError(f"{place}: <{node.tag}> {attribute} is {_short(text)}; a number expected")
    value = float(text)
    return math.copysign(math.inf, value) if abs(value) > 1e300 else value


def name_of(node: Node, attribute: str, place: str) -> str:
    """A name of 1 to 200 letters."""
    if attribute not in node.attributes:
        raise InputError(f"{place}: <{node.tag}> has no '{attribute}'{hint(attribute, node.attributes)}")
    name = node.attributes[attribute]
    if not re.fullmatch(r".{1,200}", name) or not name.strip():
        raise InputError(
            f"{place}: <{node.tag}> {attribute} is {_short(name)}; a name of 1 to 200 letters expected"
        )
    return name


def only_attributes(node: Node, allowed: Collection[str], place: str) -> None:
    """Refuse an attribute that is not allowed: a misspelt one would silently read as its default."""
    for attribute in node.attributes:
        if attribute not in allowed:
            raise InputError(
                f"{place}: <{node.tag}> has an attribute '{attribute}'{hint(attribute, allowed)} "
                f"(allowed: {listed(allowed, 'and')})"
            )


def at_most_one(node: Node, tag: str, place: str) -> Node | None:
    """The child of this tag, if there is one; two are refused."""
    found = node.all(tag)
    if len(found) > 1:
        raise InputError(f"{place}: <{node.tag}> has two <{tag}>; one is allowed")
    return found[0] if found else None


def foreign(node: Node, known: Collection[str], harmless: Collection[str], place: str) -> set[str]:
    """Tags in an element that have no part in the robot; one that is nearly a known tag is refused."""
    found = set()
    for child in node.children:
        if child.tag in known:
            continue
        if child.tag not in harmless and nearest(child.tag, known):
            raise InputError(
                f"{child.file}:{child.line}: {place}: <{child.tag}> is not known{hint(child.tag, known)}"
            )
        found.add(child.tag[:60])
    return found


def _short(text: str) -> str:
    return repr(text if len(text) <= 60 else text[:57] + "...")
