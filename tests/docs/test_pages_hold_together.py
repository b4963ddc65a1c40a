"""Every link, picture and anchor of the documentation leads somewhere, and every page is in the navigation."""

from __future__ import annotations

import re
from collections import Counter

import pytest
from documentation import DOCS, NAMES, PAGES, ROOT, anchors, links, pages_in_navigation

import jffsr


@pytest.mark.parametrize("name", NAMES)
def test_links_and_pictures_resolve(name):
    page = ROOT / name
    wrong = []
    for target in links(name):
        if re.match(r"https?://", target):
            continue
        path, _, anchor = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        # From docs/ nothing may lead out of it: the site has nothing else.
        inside = file.is_relative_to(DOCS if page.is_relative_to(DOCS) else ROOT)
        if not (file.is_file() and inside):
            wrong.append(target)
        elif anchor and not all(anchor in known for known in anchors(file)):
            wrong.append(target)
    assert not wrong


def test_links_are_seen():
    assert sum(len(links(name)) for name in NAMES) > 150
    assert "docs/images/demo_robot.png" in links("README.md")
    github, site = anchors(ROOT / "docs" / "how-to" / "plan_a_motion.md")
    assert "compiled-programs" in github & site


def test_every_page_is_in_the_navigation_once():
    listed = Counter(pages_in_navigation())
    there = {str(page.relative_to(DOCS)) for page in PAGES if page.is_relative_to(DOCS)}
    assert set(listed) == there
    assert set(listed.values()) == {1}


def test_every_public_name_is_on_one_page_of_the_api():
    homes = {name: f"{module}.{name}" for name, module in jffsr._HOME.items()}
    assert {*homes, "__version__"} == set(jffsr.__all__)
    listed = Counter()
    for page in (DOCS / "api").glob("*.md"):
        listed.update(re.findall(r"^::: (\S+)$", page.read_text(encoding="utf-8"), re.MULTILINE))
    assert listed == Counter(homes.values())
    table = (DOCS / "api" / "README.md").read_text(encoding="utf-8")
    assert Counter(re.findall(r"`(\w+)`", table[table.index("|---") :])) == Counter(homes.keys())


def test_every_benchmark_has_its_row():
    index = (DOCS / "benchmarks" / "README.md").read_text(encoding="utf-8")
    for page in (DOCS / "benchmarks").glob("*.md"):
        if page.name != "README.md":
            assert len(re.findall(rf"^\| \[.+?\]\({page.name}\) \|.*`.+`", index, re.MULTILINE)) == 1, (
                page.name
            )
