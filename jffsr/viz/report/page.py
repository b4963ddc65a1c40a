"""A page that stands alone: its style and its script are in it, and it asks nothing of any network."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from importlib.resources import files

from jffsr.viz.replay.replay import Replay
from jffsr.viz.report.replay_block import replay_block


def page(title: str, body: str, whole: bool = False) -> str:
    """An HTML document around `body`; `whole` fills the window with a replay."""
    kept = files("jffsr.viz.report")
    style = kept.joinpath("page.css").read_text(encoding="utf-8")
    script = kept.joinpath("replay.js").read_text(encoding="utf-8")
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="jffsr">
<link rel="icon" href="data:,">
<title>{escape(title)}</title>
<style>
{style}</style>
</head>
<body{' class="whole"' if whole else ""}>
<main>
{body}
</main>
<script>
{script}</script>
</body>
</html>
"""


def replay_page(replays: Sequence[Replay], title: str, below: str = "") -> str:
    """A page of one replay or several side by side, with their plots; raises InputError without viser.

    below is what follows them, as HTML.
    """
    body = f"<h1>{escape(title)}</h1>\n{replay_block(replays, title)}\n{below}"
    return page(title, body, whole=True)
