"""The page on capability maps: its Python runs as it stands and finds what it says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import jffsr

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "build_a_capability_map.md"
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


@pytest.mark.docs
def test_the_python_runs_as_it_stands(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    # The suite has used JAX before, so that its devices are chosen.
    monkeypatch.setattr("jffsr.parallel.cores.use_all_cores", lambda: 1)
    names = {}
    for block in BLOCKS:
        exec(block, names)
    assert (tmp_path / "planar.nc").exists()
    assert 0 < float(names["capability"].value([1.5, 0.5, 0.0])) < 1
    printed = capsys.readouterr().out
    assert "grasp 'handle' at 31.4 s" in printed
    assert names["found"].time == pytest.approx(31.4, abs=0.05)


def test_the_page_names_every_setting_of_the_command():
    from jffsr.study.capability import SETTINGS

    text = PAGE.read_text(encoding="utf-8")
    assert all(f"`{name}`" in text for name in SETTINGS)
    assert jffsr.capability_map.__kwdefaults__["cells"] == 20_000
