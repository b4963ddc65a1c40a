"""The page on clearances: its Python runs as it stands, its constraint is one of a study."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from jffsr.errors import InputError
from jffsr.objectives.clearance import Clearance
from jffsr.study.building import build_problem
from jffsr.study.config import load_config

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "keep_clear.md"
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
STUDY = "kind: planning\ntask: {start_deg: [90, 30], goal_deg: [-60, 90], duration: 20}\nlimits: {position_deg: 324}\n"


def build(folder: Path, text: str):
    (folder / "page.yaml").write_text(STUDY + text, encoding="utf-8")
    return build_problem(load_config(folder / "page.yaml"))


def test_the_python_runs_as_it_stands(capsys):
    (text,) = [text for kind, text in BLOCKS if kind == "python"]
    exec(text, {})
    assert "28 pairs, such as ('base', 'link2')" in capsys.readouterr().out


def test_the_constraint_is_one_of_a_study(tmp_path):
    (text,) = [text for kind, text in BLOCKS if kind == "yaml"]
    (constraint,) = build(tmp_path, "robot: hu_2011_planar2\n" + text).constraints
    assert isinstance(constraint, Clearance)
    assert constraint.margin == 0.02
    # 0.1 mm, as a share of the 0.1 m that count as 1.
    np.testing.assert_allclose(constraint.tolerance, 1e-3)
    assert constraint.model.pair_names == (("base", "link2"),)


def test_margin_must_not_be_negative(tmp_path):
    with pytest.raises(InputError, match=r"page\.yaml:5: constraints\.clearance\.margin: found -1"):
        build(tmp_path, "robot: hu_2011_planar2\nconstraints: {clearance: {margin: -1}}\n")
