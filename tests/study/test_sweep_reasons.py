"""A merged sweep keeps its name, and why points of it could not be computed."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from jffsr.planning.result import ResultCode
from jffsr.study.dataset import open_dataset
from jffsr.study.sweep.merging import FAILURE, merged, save_sweep
from jffsr.study.sweep.parts import Part


def made(failures=None):
    """Three points of two durations, the second lost."""
    points = [SimpleNamespace(values={"task.duration": duration}) for duration in (20, 30, 40)]
    results = {
        "code": np.array([0, 1]),
        "cost": np.array([0.5, 2.0]),
        "overrun_rate": np.array([-0.5, 0.25]),
        "free_numbers": np.ones((2, 3)),
        "terms": np.array(["joint_rate"]),
        "term_value": np.ones((2, 1)),
        "term_weighted": np.ones((2, 1)),
        **{
            f"history_{name}": np.ones((2, 1))
            for name in ("best_value", "evaluations", "gradient_evaluations")
        },
    }
    return merged(points, [Part((0, 2), results)], "durations", 1.0, failures)


def test_reasons_are_kept_with_the_points_that_they_stopped(tmp_path):
    save_sweep(made({1: "MemoryError: no room"}), tmp_path / "sweep.nc")
    dataset = open_dataset(tmp_path / "sweep.nc")
    assert dataset[FAILURE].values.tolist() == ["", "MemoryError: no room", ""]
    np.testing.assert_array_equal(dataset["code"].values, [0, -1, 1])


def test_codes_have_their_meanings(tmp_path):
    save_sweep(made(), tmp_path / "sweep.nc")
    code = open_dataset(tmp_path / "sweep.nc")["code"].attrs
    meanings = dict(zip(code["flag_values"].tolist(), code["flag_meanings"].split(), strict=True))
    assert meanings[-1] == "not_computed"
    assert {kind.name.lower(): int(kind) for kind in ResultCode} == {
        name: value for value, name in meanings.items() if value >= 0
    }


def test_a_whole_sweep_holds_no_reasons_and_its_own_name():
    dataset = made()
    assert FAILURE not in dataset
    assert dataset.attrs["name"] == "durations"
    np.testing.assert_array_equal(dataset["overrun_rate"].values, [-0.5, np.nan, 0.25])
