"""Every block of the page on the theory of tracking runs as it stands, and says what the page says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "theory" / "tracking.md"


@pytest.mark.docs
def test_every_block_runs(capsys):
    names = {}
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) == 2
    for text in blocks:
        exec(text, names)
    adaptive, fixed, same, rates, pushed = capsys.readouterr().out.splitlines()
    assert adaptive == "largest gain 20.19 at 0.0437, at epsilon 14.77"
    assert fixed.startswith("largest gain 8.76 at 0.0571")
    assert float(same) < 1e-11
    assert float(rates) < 1e-12
    assert float(pushed) > 1e-2
