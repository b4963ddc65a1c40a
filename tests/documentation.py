"""The pages of the documentation as tests see them: files, headings, links, code blocks and the commands in them."""

from __future__ import annotations

import re
import shlex
import tomllib
import unicodedata
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
NAMES = [str(page.relative_to(ROOT)) for page in PAGES]

_FENCE = re.compile(
    r"^(?P<indent> *)```(?P<kind>\w*)\n(?P<text>.*?)^(?P=indent)```", re.MULTILINE | re.DOTALL
)
# On three lines, which the formatter cannot take for Python, as it does `--8<-- "file"`.
_SNIPPET = re.compile(r"^--8<--\n(.+)\n--8<--$", re.MULTILINE)
_SAVE = re.compile(r"[Ss]ave this as `([\w.]+)`")


@dataclass(frozen=True)
class Block:
    """A fenced block: the page it is on, its number there among those of its kind, its kind and text.

    `saved_as` is the name of the file that the text before it asks to be made of it, if it does.
    """

    page: str
    number: int
    kind: str
    text: str
    saved_as: str | None

    @property
    def place(self) -> str:
        """Page, kind and number, from 1."""
        return f"{self.page}, {self.kind or 'plain'} block {self.number}"


def with_snippets(text: str) -> str:
    """A page's text with the files that it includes."""
    return _SNIPPET.sub(lambda found: (ROOT / found.group(1)).read_text(encoding="utf-8").rstrip("\n"), text)


def blocks(page: str) -> list[Block]:
    """The fenced blocks of a page, in order, with what they include."""
    text = (ROOT / page).read_text(encoding="utf-8")
    found, counts, end = [], {}, 0
    for fence in _FENCE.finditer(text):
        kind = fence["kind"]
        counts[kind] = counts.get(kind, 0) + 1
        saved = _SAVE.findall(text[end : fence.start()])
        end = fence.end()
        content = with_snippets(fence["text"])
        found.append(Block(page, counts[kind], kind, content, saved[-1] if saved else None))
    return found


def blocks_of(*kinds: str) -> list[Block]:
    """The blocks of these kinds on all pages."""
    return [block for page in NAMES for block in blocks(page) if block.kind in kinds]


def prose(page: str) -> str:
    """A page without its fenced blocks, what it includes shown."""
    text = with_snippets((ROOT / page).read_text(encoding="utf-8"))
    return _FENCE.sub("", text)


def inline_code(page: str) -> list[str]:
    """What stands between single backticks, line breaks as blanks."""
    return [" ".join(text.split()) for text in re.findall(r"`([^`]+)`", prose(page))]


def commands(block: Block) -> list[list[str]]:
    """The words of each command of a block, continued lines joined, comments and prompts left out."""
    text = block.text.replace("\\\n", " ")
    lines = [re.sub(r"(^|\s)#\s.*$", "", line).strip().removeprefix("$ ") for line in text.splitlines()]
    return [shlex.split(line) for line in lines if line]


def links(page: str) -> list[str]:
    """Addresses of all links and pictures of a page, in Markdown and in HTML; none of those in code."""
    text = re.sub(r"`[^`]+`", "", prose(page))
    found = re.findall(r"\]\(\s*<?([^)\s>]+)>?[^)]*\)", text)
    return found + re.findall(r'<(?:img|a)\b[^>]*?(?:src|href)="([^"]+)"', text)


def anchors(page: Path) -> tuple[set[str], set[str]]:
    """Anchors of a page's headings, by GitHub's rule and by that of the site."""
    text = _FENCE.sub("", with_snippets(page.read_text(encoding="utf-8")))
    headings = [
        re.sub(r"[`*]|\]\(.*?\)|\[", "", line) for line in re.findall(r"^#+ +(.+)$", text, re.MULTILINE)
    ]
    github = {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
    return github, {_site_anchor(heading) for heading in headings}


def _site_anchor(heading: str) -> str:
    plain = unicodedata.normalize("NFKD", heading).encode("ascii", "ignore").decode()
    return re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", plain).strip().lower())


def pages_in_navigation() -> list[str]:
    """The pages that the site's navigation lists, relative to docs/."""
    settings = tomllib.loads((ROOT / "zensical.toml").read_text(encoding="utf-8"))

    def below(entries) -> list[str]:
        found = []
        for entry in entries:
            (target,) = entry.values()
            found += [target] if isinstance(target, str) else below(target)
        return found

    return below(settings["project"]["nav"])
