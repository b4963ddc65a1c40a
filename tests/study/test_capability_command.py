"""`jffsr map`: its file and figures, what it goes on from, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

import jffsr
from jffsr import cli
from jffsr.study.capability import read_settings

SMALL = ["cells=40", "directions=4", "self_clearance=false"]


def test_a_map_is_written_with_its_figures_and_not_overwritten(tmp_path, capsys):
    out = tmp_path / "planar.nc"
    assert cli.main(["map", "ye_planar3", *SMALL, "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert str(out) in printed
    assert sorted(path.name for path in tmp_path.iterdir()) == ["planar.nc", "planar_z_slice.png"]
    capability = jffsr.load_capability_map(out)
    reached = int((capability.share > 0).sum())
    assert f"{reached} cells of {100 * float(capability.spacing):.3g} cm" in printed
    assert cli.main(["map", "ye_planar3", *SMALL, "--out", str(out)]) == 2
    assert "is there already" in capsys.readouterr().err


def test_interrupted_it_says_so_and_the_same_command_goes_on(tmp_path, capsys, monkeypatch):
    out = tmp_path / "planar.nc"
    command = ["map", "ye_planar3", *SMALL, "--out", str(out)]
    monkeypatch.setattr("jffsr.capture.capability_map.BLOCK_POSES", 64)
    from jffsr.capture import capability_map as module

    search, calls = module.search_block, []

    def once(*arguments):
        if calls:
            raise KeyboardInterrupt
        calls.append(1)
        return search(*arguments)

    monkeypatch.setattr(module, "search_block", once)
    assert cli.main(command) == 130
    assert [path.name for path in tmp_path.iterdir()] == ["planar.nc.part"]
    monkeypatch.setattr(module, "search_block", search)
    assert cli.main(command) == 0
    assert not (tmp_path / "planar.nc.part").exists()
    x, y, _ = jffsr.load_capability_map(out).axes
    np.testing.assert_allclose([x.mean(), y.mean()], [0.5, 0.0], atol=1e-12)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("cell=3", "did you mean 'cells'"),
        ("cells", "KEY=VALUE with one of"),
        ("cells=many", "a whole number is expected for cells"),
        ("margin=yes", "a number is expected for margin"),
        ("self_clearance=1", "true or false is expected"),
    ],
)
def test_settings_that_are_none_are_refused(text, words):
    with pytest.raises(jffsr.InputError, match=words):
        read_settings([text])


def test_settings_are_read():
    assert read_settings(["margin=1", "seed=3", "self_clearance=false"]) == {
        "margin": 1.0,
        "seed": 3,
        "self_clearance": False,
    }
