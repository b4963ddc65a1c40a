"""What a measurement writes into its page of the documentation: the text between the page's two marks."""

from __future__ import annotations

from pathlib import Path

BEGIN, END = "<!-- measured: begin -->", "<!-- measured: end -->"


def fill(page: Path, text: str, title: str, begin: str = BEGIN, end: str = END) -> None:
    """Put the text between the marks; a page that is not there yet gets the title alone around them."""
    old = page.read_text(encoding="utf-8") if page.exists() else f"# {title}\n\n{begin}\n{end}\n"
    before, mark, rest = old.partition(begin)
    _, other, after = rest.partition(end)
    if not (mark and other):
        raise SystemExit(f"{page} lacks the marks {begin} and {end}, between which its tables go")
    page.write_text(f"{before}{begin}\n{text}\n{end}{after}", encoding="utf-8")
