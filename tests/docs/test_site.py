"""The built site: complete, and sufficient to itself; nothing on a page is fetched from elsewhere."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest
from documentation import DOCS, ROOT, pages_in_navigation

import jffsr

pytestmark = pytest.mark.docs

# Attributes by which a browser fetches something without being asked; an ordinary link fetches nothing.
FETCHED = {"src", "srcset", "poster", "data", "action"}
FETCHING_LINKS = {
    "stylesheet",
    "icon",
    "preload",
    "prefetch",
    "preconnect",
    "dns-prefetch",
    "modulepreload",
    "manifest",
}


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    """The site, built from a copy of what it is made of, so that it is that of the pages as they are."""
    folder = tmp_path_factory.mktemp("site")
    for name in ("docs", "jffsr"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("zensical.toml", "CHANGELOG.md"):
        shutil.copy(ROOT / name, folder / name)
    program = Path(sys.executable).with_name("zensical")
    run = subprocess.run(
        [program, "build", "--strict", "--clean"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    return folder / "site"


class Requests(HTMLParser):
    """Addresses that a page fetches, and the scripts and styles that stand in it."""

    def __init__(self, text: str):
        super().__init__()
        self.addresses: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        given = {name: value or "" for name, value in attributes}
        self.addresses += [given[name] for name in FETCHED & set(given)]
        if tag == "link" and FETCHING_LINKS & set(given.get("rel", "").split()):
            self.addresses.append(given.get("href", ""))
        self.addresses += re.findall(r"url\(([^)]+)\)", given.get("style", ""))


def outside(address: str) -> bool:
    return bool(re.match(r"\s*[\"']?(https?:)?//", address))


def test_the_parser_sees_what_is_fetched():
    page = '<script src="https://a/x.js"></script><link rel="stylesheet" href="//b/y.css"><a href="https://c/">c</a>'
    assert Requests(page).addresses == ["https://a/x.js", "//b/y.css"]
    assert all(outside(address) for address in Requests(page).addresses)


def test_every_page_is_built(site):
    for page in pages_in_navigation():
        built = site / page.replace("README.md", "index.md").replace(".md", ".html")
        assert built.is_file(), page


def test_no_page_fetches_from_outside(site):
    pages = sorted(site.rglob("*.html"))
    assert len(pages) > len(pages_in_navigation())
    for page in pages:
        text = page.read_text(encoding="utf-8")
        wrong = [address for address in Requests(text).addresses if outside(address)]
        assert not wrong, f"{page.name}: {wrong}"
        inline = re.findall(r"<(?:script|style)\b[^>]*>(.*?)</(?:script|style)>", text, re.DOTALL)
        assert not any(re.search(r"@import|fetch\(|url\(\s*[\"']?(?:https?:)?//", code) for code in inline), (
            page.name
        )


def test_no_style_fetches_from_outside(site):
    styles = sorted(site.rglob("*.css"))
    assert styles
    for style in styles:
        text = style.read_text(encoding="utf-8")
        assert not re.search(r"@import\s|url\(\s*[\"']?(?:https?:)?//", text), style.name


def test_what_pages_name_inside_the_site_is_there(site):
    for page in site.rglob("*.html"):
        for address in Requests(page.read_text(encoding="utf-8")).addresses:
            if address and not re.match(r"\w+:|#", address):
                target = address.split("#")[0].split("?")[0]
                base = site if target.startswith("/") else page.parent
                assert (base / target.lstrip("/")).exists(), f"{page.name}: {address}"


def test_docstrings_are_on_the_pages(site):
    pages = "".join(page.read_text(encoding="utf-8") for page in (site / "api").glob("*.html"))
    for name, module in jffsr._HOME.items():
        assert f'id="{module}.{name}"' in pages, name
    assert "Generalized Jacobian J* = J_m - J_b H_b^-1 H_bm (6, n)" in pages


def test_examples_and_changelog_are_included(site):
    assert (DOCS / "examples" / "first_plan.py").is_file()
    assert "SinePolynomial" in (site / "start.html").read_text(encoding="utf-8")
    assert "Keep a Changelog" in (site / "changelog.html").read_text(encoding="utf-8")
    assert not any("--8&lt;--" in page.read_text(encoding="utf-8") for page in site.rglob("*.html"))
