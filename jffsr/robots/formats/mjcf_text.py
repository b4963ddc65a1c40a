"""MJCF before MuJoCo sees it: included files, what is refused by name, and what has no part in a robot."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from xml.sax.saxutils import quoteattr

from jffsr.errors import InputError
from jffsr.reading.files import read_text
from jffsr.reading.xml_tree import Node, parse_xml
from jffsr.robots.formats.xml_values import MOST_BODIES, NUMBER

_MOST_INCLUDES = 100
_MOST_ELEMENTS = 100_000
_MOST_COPIES = 1000
_MOST_BYTES = 10_000_000

# Sections that act on the robot from outside, measure it, or draw it.
_SECTIONS_PASSED_OVER = {
    "actuator",
    "sensor",
    "keyframe",
    "contact",
    "visual",
    "statistic",
    "option",
    "size",
    "custom",
}
_ASSETS_PASSED_OVER = {"texture", "hfield"}
_DEFAULTS_PASSED_OVER = {
    "camera", "light", "pair", "equality", "tendon", "general", "motor", "position", "velocity", "intvelocity",
    "damper", "cylinder", "muscle", "adhesion",
}  # fmt: skip
_IN_BODIES_PASSED_OVER = {"camera", "light"}
_IN_WORLD_PASSED_OVER = {"geom", "site", "camera", "light"}
_BODY_TREE = ("worldbody", "body", "frame", "replicate")

_REFUSED_SECTIONS = {
    "equality": "equality constraint <{tag}>{name}: closed loops and coupled joints are not supported",
    "tendon": "tendon <{tag}>{name}: tendons are not supported",
    "deformable": "deformable <{tag}>{name}: only rigid bodies are supported",
    "extension": "<{tag}>{name} in <extension>: plugins are not supported",
}
_REFUSED = {
    "plugin": "plugins are not supported",
    "composite": "composite objects are not supported",
    "flexcomp": "flexible objects are not supported",
    "skin": "skins of deforming bodies are not supported",
    "attach": "attached models are not supported; save the whole model as one file",
}
_FINITE = (
    "pos", "quat", "axisangle", "xyaxes", "zaxis", "euler", "axis", "ref", "mass", "diaginertia", "fullinertia",
    "size", "fromto", "density", "scale", "refpos", "refquat",
)  # fmt: skip
NUMBERS = ("velocity_limit", "acceleration_limit", "joint_number", "end_effector_number")
"""What MJCF has no place for: `jffsr.to_mjcf` writes it under <custom>, as numbers named KIND:NAME."""

_NAMES = ("name", "class", "childclass", "model", "file", "mesh", "material")
_NAN = re.compile(r"[+-]?nan(\(.*\))?", re.IGNORECASE)


@dataclass
class Prepared:
    """A text for MuJoCo with one element a line, and what stood in the file on each line."""

    text: str = ""
    nodes: list[Node] = field(default_factory=list)
    numbers: dict[str, dict[str, float]] = field(default_factory=lambda: {kind: {} for kind in NUMBERS})
    notes: list[str] = field(default_factory=list)

    def blame(self, line: int, shown: str) -> str:
        """File, line and body of a line of `text`."""
        if not 1 <= line <= len(self.nodes):
            return shown
        return place_of(self.nodes[line - 1])


def prepare(root: Node, shown: str, folder: Path) -> Prepared:
    """The text that MuJoCo is to read; InputError where something in it is not supported."""
    _include(root, folder, [shown], [0, 0])
    prepared = Prepared()
    _read_custom(root, prepared)
    _refuse(root)
    _pass_over(root)
    lines: list[str] = []
    _write(root, lines, prepared.nodes)
    prepared.text = "\n".join(lines) + "\n"
    return prepared


def place_of(node: Node) -> str:
    """`file:line: body 'name': joint 'name'`, as far as there are names."""
    words = [node.place]
    body: Node | None = node
    while body is not None and body.tag != "body":
        body = body.parent
    if body is not None:
        words.append(
            f"body {body.get('name')!r}"
            if body.get("name")
            else f"the body without a name in line {body.line}"
        )
    if node is not body and node.tag in ("joint", "geom", "site", "mesh") and node.get("name"):
        words.append(f"{node.tag} {node.get('name')!r}")
    return ": ".join(words)


def _include(node: Node, folder: Path, stack: list[str], count: list[int]) -> None:
    """Replace <include file=.../> by what stands in that file, as MuJoCo would."""
    children = []
    for child in node.children:
        if child.tag != "include":
            _include(child, folder, stack, count)
            children.append(child)
            continue
        name = child.get("file")
        count[0] += 1
        if not name or name in stack or count[0] > _MOST_INCLUDES:
            why = (
                "a file includes itself"
                if name in stack
                else f"at most {_MOST_INCLUDES} files can be included"
            )
            raise InputError(f"{child.place}: <include> {name!r}: {why if name else 'no file is named'}")
        try:
            # What all included files hold together is limited, or a small fan of them would take hours.
            text = read_text(folder / name, name, "MJCF", _MOST_BYTES - count[1])
            count[1] += len(text)
            content = parse_xml(text, name)
        except InputError as error:
            raise InputError(f"{child.place}: <include>: {error}") from None
        _include(content, folder, [*stack, name], count)
        for part in content.children:
            part.parent = node
            children.append(part)
    node.children = children


def _read_custom(root: Node, prepared: Prepared) -> None:
    for section in root.all("custom"):
        for node in section.all("numeric"):
            kind, _, name = node.get("name").partition(":")
            if kind in NUMBERS and name:
                if not NUMBER.fullmatch(node.get("data").strip()):
                    said = f"{kind} of '{name}' is {node.get('data')!r}; a number expected"
                    raise InputError(f"{node.place}: {said}")
                prepared.numbers[kind][name] = float(node.get("data"))


def _refuse(root: Node) -> None:
    for section in root.children:
        for node in section.children:
            if section.tag in _REFUSED_SECTIONS:
                name = f" '{node.get('name')}'" if node.get("name") else ""
                raise InputError(
                    f"{node.place}: " + _REFUSED_SECTIONS[section.tag].format(tag=node.tag, name=name)
                )
    bodies = 0
    for count, node in enumerate(root.walk()):
        if count > _MOST_ELEMENTS:
            raise InputError(f"{root.file}: there are more than {_MOST_ELEMENTS:,} elements")
        if node.tag in _REFUSED:
            name = f" '{node.get('name')}'" if node.get("name") else ""
            raise InputError(f"{place_of(node)}: <{node.tag}>{name}: {_REFUSED[node.tag]}")
        if node.get("mocap") == "true":
            raise InputError(
                f"{place_of(node)}: mocap bodies, which are moved from outside, are not supported"
            )
        if node.tag == "replicate":
            _check_copies(node)
        for attribute, value in node.attributes.items():
            # At a NaN, MuJoCo writes a log file into the working folder.
            if attribute not in _NAMES and any(_NAN.fullmatch(word) for word in value.split()):
                raise InputError(f"{place_of(node)}: <{node.tag}> {attribute} '{value}' is not finite")
        for attribute in _FINITE:
            for word in node.get(attribute).split():
                if NUMBER.fullmatch(word) and not abs(float(word)) <= 1e30:
                    raise InputError(
                        f"{place_of(node)}: <{node.tag}> {attribute} '{node.get(attribute)}' is not finite"
                    )
        bodies += node.tag == "body"
        if bodies > MOST_BODIES:
            raise InputError(f"{root.file}: there are more than {MOST_BODIES} bodies")
        if node.tag == "inertial":
            mass = node.get("mass").strip()
            # MuJoCo reads a negative mass as zero.
            if NUMBER.fullmatch(mass) and float(mass) < 0:
                raise InputError(f"{place_of(node)}: mass is {mass} kg; it must be positive")


def _check_copies(node: Node) -> None:
    copies, outer = 1, node
    while outer is not None:
        if outer.tag == "replicate":
            word = outer.get("count").strip()
            copies *= int(word) if word.isdecimal() and len(word) < 9 else _MOST_COPIES + 1
        outer = outer.parent
    if copies > _MOST_COPIES:
        raise InputError(
            f"{node.place}: <replicate> would make more than {_MOST_COPIES} copies, or states no number"
        )


def _pass_over(root: Node) -> None:
    root.children = [section for section in root.children if section.tag not in _SECTIONS_PASSED_OVER]
    for node in root.walk():
        if node.tag == "asset":
            drop = _ASSETS_PASSED_OVER
        elif node.tag == "default":
            drop = _DEFAULTS_PASSED_OVER
        elif node.tag == "material":
            node.attributes = {key: value for key, value in node.attributes.items() if key != "texture"}
            drop = {"layer"}
        elif node.tag in _BODY_TREE:
            drop = _IN_BODIES_PASSED_OVER if _in_body(node) else _IN_WORLD_PASSED_OVER
        else:
            continue
        node.children = [child for child in node.children if child.tag not in drop]


def _in_body(node: Node | None) -> bool:
    while node is not None:
        if node.tag == "body":
            return True
        node = node.parent
    return False


def _write(root: Node, lines: list[str], nodes: list[Node]) -> None:
    waiting: list[tuple[Node, bool]] = [(root, False)]
    while waiting:
        node, closing = waiting.pop()
        if closing:
            lines[-1] += f"</{node.tag}>"
            continue
        words = "".join(f" {key}={quoteattr(value)}" for key, value in node.attributes.items())
        lines.append(f"<{node.tag}{words}>".replace("\n", " "))
        nodes.append(node)
        waiting.append((node, True))
        waiting.extend((child, False) for child in reversed(node.children))
