"""Tables of a page as lists of texts, read by Python's own parser of HTML."""

from __future__ import annotations

from html.parser import HTMLParser


class _Reader(HTMLParser):
    def __init__(self):
        super().__init__()
        self.tables: list[list[list[str]]] = []
        self._inside = False

    def handle_starttag(self, tag, attrs):
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][-1].append("")
            self._inside = True

    def handle_endtag(self, tag):
        if tag in ("td", "th"):
            self._inside = False

    def handle_data(self, data):
        if self._inside:
            self.tables[-1][-1][-1] += data


def tables_of(html: str) -> list[list[list[str]]]:
    """All tables of a page, each as rows of cells, its head among them."""
    reader = _Reader()
    reader.feed(html)
    return reader.tables


def columns_of(table: list[list[str]]) -> dict[str, list[str]]:
    """The columns of a table by their heads."""
    head, *rows = table
    return {name: [row[number] for row in rows] for number, name in enumerate(head)}
