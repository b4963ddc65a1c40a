"""The page on tracking: its study is one that can be built, its Python runs as it stands."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from jffsr.study.config import load_config
from jffsr.study.tracking.building import build_task, build_tracker

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "track_a_path.md"
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


def test_the_study_is_one(tmp_path):
    (text,) = [text for kind, text in BLOCKS if kind == "yaml"]
    (tmp_path / "page.yaml").write_text(text, encoding="utf-8")
    config = load_config(tmp_path / "page.yaml")
    assert build_task(config).target.duration == 25
    (section,) = config.trackers.values()
    assert build_tracker(section).position_gain == 2


@pytest.mark.docs
def test_the_python_runs_as_it_stands(capsys):
    text, shown = [text for kind, text in BLOCKS if kind == "python"]
    assert "docs/examples/track_a_circle.py" in shown  # run by tests/docs/test_examples.py
    names = {}
    exec(text, names)
    assert "position_peak" in capsys.readouterr().out
    assert np.max(np.abs(names["tracked"].pose_error)) < 1e-4
