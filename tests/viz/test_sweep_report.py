"""What the report of a sweep says: its best setting, what binds, what was fixed, which points fell short and why."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray
from page_tables import columns_of, tables_of

from jffsr import cli
from jffsr.errors import InputError
from jffsr.planning.result import ResultCode
from jffsr.study.dataset import save_dataset
from jffsr.study.schema import PlanningConfig
from jffsr.study.sweep.ended import failures_of, read_ended
from jffsr.study.sweep.merging import FAILURE, MISSING
from jffsr.viz import showing
from jffsr.viz.report.sweep import fixed
from jffsr.viz.report.sweep_findings import best_setting, binding_table, short_points, varied_table

MET, NOT_MET, LIMITS, NOT_VERIFIED = (
    ResultCode.ACCURACY_MET,
    ResultCode.ACCURACY_NOT_MET,
    ResultCode.LIMITS_VIOLATED,
    ResultCode.NOT_VERIFIED,
)
SPEC = """\
kind: sweep
name: durations
base:
  kind: planning
  robot: wu_6dof
  task: {start_deg: [175, -60, -60, 0, 210, 5], goal_deg: [120, -30, -95, 40, 170, 60], duration: 30}
  limits: {rate: 0.25}
grid:
  task.duration: [20, 30, 40]
seeds: [0, 1]
"""


def merged_sweep(code=(NOT_MET, LIMITS, MET, MET, MISSING, MET)) -> xarray.Dataset:
    """Three durations with two seeds: the first falls short, the second is met, of the third one point is lost."""
    cost = np.array([5.0, 0.5, 0.25, 0.75, np.nan, 0.001])
    nothing = np.zeros(6)
    weighted = [[1.0, 3.0], [4.0, 0.0], [0.0, 2.0], [1.0, 1.0], [np.nan, np.nan], [3.0, 1.0]]
    return xarray.Dataset(
        {
            "code": ("point", np.array(code, int)),
            "cost": ("point", cost),
            "cost_finer": ("point", 1.1 * cost),
            "evaluations": ("point", np.full(6, 40)),
            "gradient_evaluations": ("point", np.zeros(6, int)),
            "attitude_difference": ("point", np.full(6, 2e-4)),
            "momentum_drift": ("point", np.full(6, 3e-5)),
            "violation": ("point", nothing),
            "overrun_rate": ("point", np.array([-0.25, 0.125, -0.5, -0.5, np.nan, -0.0])),
            "overrun_excursion": ("point", np.array([-0.75, -0.5, -0.125, -0.25, np.nan, -0.5])),
            "overrun_torque": ("point", np.full(6, -np.inf)),
            "term_weighted": (("point", "term"), np.array(weighted)),
            "task.duration": ("point", np.repeat([20, 30, 40], 2), {"units": "s"}),
            "seed": ("point", np.tile([0, 1], 3), {"units": "1"}),
        },
        coords={"term": ["attitude_change", "joint_rate"]},
        attrs={"swept_keys": json.dumps(["task.duration", "seed"]), "accuracy": 1.0, "kind": "sweep"},
    )  # fmt: skip


def test_the_best_setting_is_the_one_most_of_whose_runs_are_met():
    said = best_setting(merged_sweep())
    # The third's one run is met, so is every run of the second: the least median decides.
    assert "task.duration = 40 s" in said
    assert "accuracy (J at most 1) met" in said
    lost = merged_sweep((NOT_MET, LIMITS, MET, MET, NOT_MET, NOT_MET))
    said = best_setting(lost)
    assert "task.duration = 30 s" in said
    assert "met by 2 of its 2 runs, J at best 0.25, median 0.5" in said
    assert 'class="verdict met"' in said
    assert 'class="verdict missed"' in best_setting(merged_sweep((NOT_MET,) * 6))


def test_a_sweep_without_a_value_has_no_best_setting():
    dataset = merged_sweep()
    dataset["cost"].values[:] = np.nan
    assert "No point of this sweep has a value of J." in best_setting(dataset)
    dataset["missed_clearance"] = ("point", np.ones(6))
    assert "in none did the search find a motion that keeps every constraint." in best_setting(dataset)


def test_every_setting_says_what_binds_in_its_best_run():
    columns = columns_of(tables_of(binding_table(merged_sweep()))[0])
    assert columns["task.duration"] == ["20", "30", "40"]
    assert columns["J of the best run"] == ["0.55", "0.275", "0.0011"]
    assert columns["term that costs most"] == ["attitude change", "joint rate", "attitude change"]
    assert columns["its share"] == ["100 %", "100 %", "75 %"]
    assert columns["limit with least left"] == [
        "joint rate, over by 12.5 %",
        "base excursion, 12.5 % left",
        "joint rate, less than 0.01 % left",
    ]
    # A law that goes as far as the position limits allow, and never beyond, hides what else binds.
    touching = merged_sweep().assign(overrun_position=("point", np.full(6, -1e-9)))
    (table,) = tables_of(binding_table(touching, ("position",)))
    assert columns_of(table) == columns
    (table,) = tables_of(binding_table(touching))
    assert columns_of(table)["limit with least left"][1] == "joint position, less than 0.01 % left"


def test_points_that_fell_short_say_why():
    dataset = merged_sweep((NOT_MET, LIMITS, MET, NOT_VERIFIED, MISSING, MET))
    dataset[FAILURE] = ("point", np.array(["", "", "", "", "MemoryError: no room", ""]))
    html = short_points(dataset)
    columns = columns_of(tables_of(html)[0])
    assert columns["point"] == ["4", "0", "1", "3"]
    assert columns["seed"] == ["0", "0", "1", "1"]
    why = columns["why"]
    assert why[0] == "MemoryError: no room"
    assert why[1] == "the search settled above the accuracy; joint rate costs most (75 % of J)"
    assert why[2] == "a limit is not kept: joint rate, over by 12.5 %"
    assert why[3].startswith("not verified: the finer re-run differs by 0.0002 rad")
    assert "3 points missed their accuracy, 1 could not be computed" in html
    constrained = merged_sweep((ResultCode.CONSTRAINTS_VIOLATED, *[MET] * 5))
    (row,) = tables_of(short_points(constrained))[0][1:]
    assert row[-1] == "a constraint is missed"
    for name, value in (("missed_clearance", 0.03), ("allowed_clearance", 1e-4)):
        constrained[name] = ("point", np.full(6, value), {"units": "m"})
    (row,) = tables_of(short_points(constrained))[0][1:]
    assert row[-1] == "clearance missed by 0.03 m (allowed 0.0001 m)"
    constrained["code"].values[0] = NOT_VERIFIED
    (row,) = tables_of(short_points(constrained))[0][1:]
    assert row[-1].startswith("not verified: the finer re-run differs")
    assert row[-1].endswith("; clearance missed by 0.03 m (allowed 0.0001 m)")
    assert short_points(dataset.isel(point=[2, 5])) == ""


def test_keys_with_texts_are_shown_as_they_are():
    dataset = merged_sweep()
    dataset["optimizer.kind"] = ("point", np.array(["qpso", "hybrid"] * 3, dtype=object))
    dataset.attrs["swept_keys"] = json.dumps(["task.duration", "optimizer.kind"])
    assert columns_of(tables_of(short_points(dataset))[0])["optimizer.kind"] == ["qpso", "qpso", "hybrid"]
    assert "task.duration = 40 s, optimizer.kind = hybrid: J 0.001, accuracy" in best_setting(dataset)
    assert columns_of(tables_of(binding_table(dataset))[0])["optimizer.kind"] == ["qpso", "hybrid"] * 3
    assert ["optimizer.kind", "2", "qpso, hybrid", ""] in tables_of(varied_table(dataset))[0]


def test_a_sweep_from_before_reasons_were_kept_says_so():
    assert failures_of(merged_sweep()) == {4: "not recorded"}


def test_what_was_varied_has_units_and_what_was_fixed_has_the_rest():
    rows = tables_of(varied_table(merged_sweep()))[0][1:]
    assert rows == [["task.duration", "3", "20, 30, 40", "s"], ["seed", "2", "0, 1", ""]]
    config = PlanningConfig.model_validate(
        {
            "kind": "planning",
            "name": "p",
            "robot": "wu_6dof",
            "limits": {"rate": 0.25},
            "task": {
                "start_deg": [175, -60, -60, 0, 210, 5],
                "goal_deg": [120, -30, -95, 40, 170, 60],
                "duration": 30,
            },
        }
    )
    joints, task, rest = tables_of(fixed(config, ["task.duration", "optimizer.particles"]))
    assert columns_of(joints)["goal [deg]"] == ["120", "-30", "-95", "40", "170", "60"]
    assert task[1] == ["robot", "wu_6dof", ""]
    _, task_of_own, _ = tables_of(fixed(config, [], "robot/arm.urdf"))
    assert task_of_own[1] == ["robot", "robot/arm.urdf", ""]
    keys = {row[0] for row in (*task, *rest)}
    assert "duration" not in keys
    assert "optimizer.kind" in keys
    assert "optimizer.particles" not in keys


def write_sweep(folder, dataset) -> None:
    folder.mkdir(exist_ok=True)
    texts = {name: {"dtype": "S1"} for name in dataset.variables if dataset[name].dtype.kind == "U"}
    save_dataset(dataset, folder / "sweep.nc", texts)
    (folder / "config.yaml").write_text(SPEC)
    (folder / "table.md").write_text("| a table |\n")


def test_a_sweep_with_lost_points_can_be_shown(tmp_path, capsys, monkeypatch):
    dataset = merged_sweep()
    dataset[FAILURE] = ("point", np.array(["", "", "", "", "MemoryError: no room", ""]))
    write_sweep(tmp_path / "s", dataset)
    summary = read_ended(tmp_path / "s")
    assert (summary["points"], summary["computed"], summary["met"]) == (6, 5, 3)
    assert summary["name"] == "durations"
    monkeypatch.setattr(showing, "can_serve", lambda: True)
    assert cli.main(["show", str(tmp_path / "s")]) == cli.MET
    said = capsys.readouterr().out
    assert "replay        not opened, for there is no terminal; --serve opens it" in said
    monkeypatch.setattr(showing, "can_serve", lambda: False)
    assert cli.main(["show", str(tmp_path / "s")]) == cli.MET
    assert "not opened, for viser is not installed" in capsys.readouterr().out
    assert "3 of 6 points met their accuracy; 1 could not be computed" in said
    assert "failed        point 4: MemoryError: no room" in said
    assert "best    task.duration = 40 s" in said
    assert "short   1 accuracy not met, 1 limits violated; jffsr show with --report says why" in said


def test_a_sweep_under_way_is_refused(tmp_path):
    (tmp_path / "config.yaml").write_text(SPEC)
    with pytest.raises(InputError, match="not a finished sweep"):
        read_ended(tmp_path)
    write_sweep(tmp_path, merged_sweep())
    (tmp_path / "sweep.nc").write_bytes(b"half")
    with pytest.raises(InputError, match="cannot be read"):
        read_ended(tmp_path)
