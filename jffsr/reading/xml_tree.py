"""An XML text as a tree whose elements know their lines; hostile texts end in one sentence."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from jffsr.errors import InputError

MAX_DEPTH = 400
"""Elements inside one another; MuJoCo's reader gives up at 500."""


@dataclass(eq=False)
class Node:
    """An element: its tag, attributes, file and line, the elements in it, and the one that it is in."""

    tag: str
    attributes: dict[str, str]
    file: str
    line: int
    parent: Node | None = None
    children: list[Node] = field(default_factory=list)

    def all(self, tag: str) -> list[Node]:
        """The children of this tag."""
        return [child for child in self.children if child.tag == tag]

    def walk(self) -> Iterator[Node]:
        """This element and all inside it, in the order of the text."""
        waiting = [self]
        while waiting:
            node = waiting.pop()
            yield node
            waiting.extend(reversed(node.children))

    def get(self, attribute: str, default: str = "") -> str:
        """The attribute's text."""
        return self.attributes.get(attribute, default)

    @property
    def place(self) -> str:
        """`file:line`."""
        return f"{self.file}:{self.line}"


def parse_xml(text: str, shown: str) -> Node:
    """The root element of a text; InputError, with `shown` and the line, where it is no sound XML."""
    # The text is decoded already: what its first line says about an encoding no longer holds.
    parser = expat.ParserCreate("utf-8")
    top: list[Node] = []
    open_nodes: list[Node] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        if len(open_nodes) >= MAX_DEPTH:
            raise InputError(
                f"{shown}:{parser.CurrentLineNumber}: elements stand more than {MAX_DEPTH} deep inside one another"
            )
        parent = open_nodes[-1] if open_nodes else None
        node = Node(tag, attributes, shown, parser.CurrentLineNumber, parent)
        (parent.children if parent else top).append(node)
        open_nodes.append(node)

    def end(tag: str) -> None:
        open_nodes.pop()

    def entity(name: str, *rest: object) -> None:
        raise InputError(
            f"{shown}:{parser.CurrentLineNumber}: the entity '{name[:50]}' is declared; entities are not allowed"
        )

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.EntityDeclHandler = entity
    try:
        parser.Parse(text.encode("utf-8", "surrogatepass"), True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise InputError(f"{shown}:{error.lineno}: this is not well-formed XML ({reason})") from None
    return top[0]
