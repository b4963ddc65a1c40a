"""What the writers of URDF and MJCF share: numbers that read back as they were, names, the text."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable

import numpy as np


def decimal(value) -> str:
    """The shortest decimal number, of 17 digits at most, that reads back as the same float64."""
    return repr(float(value) + 0.0)


def decimals(values: Iterable) -> str:
    """Numbers apart by spaces."""
    return " ".join(decimal(value) for value in np.asarray(values, dtype=float).ravel())


def safe_name(name: str) -> str:
    """A name without the characters that XML cannot hold."""
    return re.sub("[\x00-\x1f\x7f\ud800-\udfff\ufffe\uffff]", "_", name)


def unique(name: str, taken: set[str]) -> str:
    """The name, with underscores appended until it is a new one; it is then taken."""
    while name in taken:
        name += "_"
    taken.add(name)
    return name


def comment(text: str) -> ET.Element:
    """A comment; two hyphens would end it."""
    return ET.Comment(" " + re.sub("-(?=-)", "- ", safe_name(text)) + " ")


def xml_text(root: ET.Element) -> str:
    """The element as an indented text that ends in a line break."""
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"
