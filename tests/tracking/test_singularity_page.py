"""Every block of the page on singularities runs as it stands, and says what the page says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "find_singularities.md"


@pytest.mark.docs
def test_every_block_runs(capsys):
    names = {}
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) == 2
    for text in blocks:
        exec(text, names)
    said = capsys.readouterr().out
    assert "joint2 11.3" in said
    assert (
        "    dynamic: this posture is singular; with the base held the arm is singular 11.3 deg away" in said
    )
    assert "near a kinematic singularity" in said
