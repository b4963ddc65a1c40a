"""Every block of the page on composition runs as it stands."""

from __future__ import annotations

import re
from pathlib import Path

import jax
import numpy as np
import pytest

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "compose_a_robot.md"


@pytest.mark.docs
def test_every_block_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {}
    blocks = re.findall(r"```(\w+)\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    for kind, text in blocks:
        if kind == "yaml":
            (tmp_path / text.split("\n")[0].removeprefix("# ")).write_text(text, encoding="utf-8")
        else:
            exec(text, names)
    assert [kind for kind, _ in blocks] == ["python"] * 3 + ["yaml", "python"]
    assert "left_joint1" in capsys.readouterr().out
    # What the page promises of its example: down the gradient, and the best of a hundred, it is better.
    start, downhill = np.array([0.0, 0.5, 0.0]), names["downhill"] / np.linalg.norm(names["downhill"])
    at_start, below, best = jax.jit(jax.vmap(names["coupling"]))(
        np.stack([start, start + 1e-3 * downhill, names["best"]])
    )
    assert below < at_start
    assert best < at_start
    np.testing.assert_allclose(names["compound"].mass.sum(), names["robot"].mass[:13].sum() - 8, rtol=1e-14)
