"""The page on holding the base still: its YAML is read, its Python runs as it stands."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from jffsr.study.config import load_config
from jffsr.study.reactionless.schema_hold import CONTROLLERS, ESTIMATORS

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "hold_the_base_still.md").read_text(encoding="utf-8")


def test_the_yaml_is_a_study(tmp_path):
    (text,) = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)
    file = tmp_path / "study.yaml"
    file.write_text(text)
    config = load_config(file)
    assert config.hold.gains.rate == 20
    assert list(config.holds) == ["plain", "known"]
    assert config.holds["known"].controller == "computed_torque"
    assert config.strike.time == 20


@pytest.mark.docs
def test_the_python_holds_the_base(capsys):
    (text,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    names = {}
    exec(text, names)
    assert float(capsys.readouterr().out.split()[-1]) < 1e-12
    assert int(names["found"].code) == 0
    assert np.max(np.abs(names["found"].joint_velocity)) > 1e-3


def test_every_estimator_and_controller_is_named():
    for name in (*ESTIMATORS, *CONTROLLERS):
        assert f"`{name}`" in PAGE, name
