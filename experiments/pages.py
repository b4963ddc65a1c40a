"""What a measurement writes into its page of the documentation: the text between the page's two marks."""

from __future__ import annotations

from pathlib import Path

BEGIN, END = "<!-- measured: begin -->", "<!-- measured: end -->"


def fill(page: Path, text: str, title: str) -> None:
    """Put the text between the marks; a page that is not there yet gets the title alone around them."""
    old = page.read_text(encoding="utf-8") if page.exists() else f"# {title}\n\n{BEGIN}\n{END}\n"
    before, mark, rest = old.partition(BEGIN)
    _, other, after = rest.partition(END)
    if not (mark and other):
        raise SystemExit(f"{page} lacks the marks {BEGIN} and {END}, between which its tables go")
    page.write_text(f"{before}{BEGIN}\n{text}\n{END}{after}", encoding="utf-8")
