"""Every block of the page on loading runs as it stands, and says what the page says."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "load_a_robot.md"


def test_every_block_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {}
    blocks = re.findall(r"```(\w+)\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert [kind for kind, _ in blocks] == ["xml", "python", "python", "python"]
    for kind, text in blocks:
        if kind == "xml":
            (tmp_path / "satellite.urdf").write_text(text, encoding="utf-8")
        else:
            exec(text, names)
    said = capsys.readouterr().out
    assert "('shoulder',) ('gripper',)" in said
    assert "joint 'shoulder': damping 0.7 is left out" in said
    assert "mesh file 'package://satellite_description/meshes/bus.stl' is not found" in said
    np.testing.assert_allclose(names["again"].inertia, names["robot"].inertia, rtol=0, atol=1e-14)
    assert names["again"].limits.velocity.tolist() == [0.4]
    assert names["text"].startswith("<?xml")
