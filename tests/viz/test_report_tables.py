"""Tables of a report: joints with their units, terms, and what other simulators said of each kind of run."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest
from page_tables import columns_of, tables_of

import jffsr
from jffsr.crosscheck.beside_target import Contact
from jffsr.crosscheck.contacts import ContactReport
from jffsr.crosscheck.report import Comparison, CrosscheckReport, Tolerances
from jffsr.robots.robot import Limits
from jffsr.study.capture.reviewing import CaptureCheck
from jffsr.study.reactionless.checking import HoldCheck, HoldComparison
from jffsr.tracking.mujoco_report import TrackedCheck, TrackedComparison, TrackedTolerances
from jffsr.viz.report.report import scales
from jffsr.viz.report.simulators import simulators_block
from jffsr.viz.report.tables import compared, measured, terms_table
from jffsr.viz.report.task import joints_table, task_tables
from jffsr.viz.report.units import name_and_unit


@pytest.fixture(scope="module")
def two_arms(robots):
    """A robot with joints that turn and one that slides, with limits of position alone."""
    robot = robots["two_arms"]
    count = robot.num_joints
    return robot.replace(
        limits=replace(
            Limits.symmetric(position=1.0, velocity=np.inf, acceleration=np.inf, num_joints=count),
            position_upper=np.where(np.arange(count) == 0, np.inf, 1.0),
        )
    )


def test_joints_have_rows_of_their_own_in_their_own_units(two_arms):
    turning = np.asarray(two_arms.topology.is_revolute)
    assert turning.any()
    assert not turning.all()
    task = {"start": [0.5] * len(turning), "goal": [0.25] * len(turning)}
    columns = columns_of(tables_of(joints_table(two_arms, task))[0])
    assert columns["joint"] == list(two_arms.joint_names)
    assert columns[""] == ["turns" if turns else "slides" for turns in turning]
    expected = [f"{180 / np.pi * 0.5:.4g}" if turns else "0.5" for turns in turning]
    assert columns["start [deg or m]"] == expected
    assert columns["upper limit [deg or m]"][0] == "none"
    assert columns["lower limit [deg or m]"][0] == f"{-180 / np.pi:.4g}"
    # None of them has another limit.
    assert not any("rate" in head or "acceleration" in head or "torque" in head for head in columns)


def test_degrees_stay_degrees_and_what_a_sweep_sets_is_left_out(robots):
    robot = robots["wu_2018_6dof"]
    task = {"start_deg": [175.0, -60.0, -60.0, 0.0, 210.0, 5.0], "goal": [1.0] * 6, "duration": 30.0}
    columns = columns_of(tables_of(joints_table(robot, task))[0])
    assert columns["start [deg]"] == ["175", "-60", "-60", "0", "210", "5"]
    assert columns["goal [deg]"] == ["57.3"] * 6
    config = {
        "robot": "wu_6dof",
        "task": task | {"linear_momentum": [0.0, 1.0, 0.0]},
        "limits": {"rate": {"joint2": 0.1}},
    }
    joints, others = tables_of(task_tables(robot, config, ["task.goal", "task.duration"]))
    assert "start [deg]" in joints[0]
    assert "goal [deg]" not in joints[0]
    assert others[1:] == [["robot", "wu_6dof", ""], ["linear momentum", "0, 1, 0", "N s"]]


@pytest.mark.parametrize(
    ("key", "name", "unit"),
    [
        ("nearest_approach.1.time_s", "nearest approach, 1, time", "s"),
        ("grasp_error.linear_velocity_m_s", "grasp error, linear velocity", "m/s"),
        ("largest_overrun_relative.rate", "largest overrun, rate", "relative"),
        ("hold.rate", "hold, rate", "Hz"),
        ("hold.gains.position", "hold, gains, position", ""),
        ("path.poses.2.position", "path, poses, 2, position", "m"),
        ("limits.base_excursion_deg", "limits, base excursion", "deg"),
        ("optimizer.particles", "optimizer, particles", ""),
    ],
)
def test_a_number_is_named_with_its_unit(key, name, unit):
    assert name_and_unit(key) == (name, unit)


def test_lists_without_numbers_are_left_out_of_what_was_measured():
    rows = tables_of(measured({"a_m": 2.0, "b": [None, None], "c": {"d_rad": [1.0, None]}}))[0][1:]
    assert rows == [["a", "2", "m"], ["c, d", "1, –", "rad"]]


def test_terms_say_their_units_and_what_counts_one():
    terms = {
        "attitude_change": {"value": 0.1, "weighted": 57.3, "unit": "rad"},
        "joint_rate": {"value": 0.02, "weighted": 2.0, "unit": "relative"},
        "own": {"value": 3.0, "weighted": 3.0, "unit": "kg"},
    }
    objective = {"attitude_change": {"scale_deg": 0.1}, "joint_rate": {"scale": 0.01}, "terms": []}
    html = terms_table(terms, {"own": {"weighted": 3.5}}, scales(objective, terms))
    columns = columns_of(tables_of(html)[0])
    assert columns["unit"] == ["rad", "relative", "kg"]
    assert columns["counts 1 at"] == ["0.1 deg", "0.01 relative", "–"]
    assert columns["weighted, finer re-run"] == ["", "", "3.5"]
    assert "finer step" in html.split("</table>")[1]
    alone = terms_table(terms, {})
    assert "finer" not in alone
    assert "counts" not in alone
    assert terms_table({}, {}) == ""


def test_what_a_run_compares_has_units_in_its_heads():
    runs = {"one": {"sentence": "still", "base_rate": 0.1, "held": 1}, "two": {"base_rate": 0.2, "held": 0}}
    columns = columns_of(tables_of(compared(runs))[0])
    assert columns["base rate [rad/s]"] == ["0.1", "0.2"]
    assert columns[""] == ["one", "two"]


def shown(found) -> tuple[str, list[list[str]]]:
    html = simulators_block(found)
    tables = tables_of(html)
    return html, tables[0] if tables else []


def test_the_check_of_a_plan_is_a_row_for_each_engine_and_step():
    def entry(engine, step, attitude):
        return Comparison(engine, step, attitude, 2e-6, 3e-9, 4e-9, np.nan, 1e-8, 1e-8, 5.0, 6.0)

    comparisons = (entry("mujoco", 2e-3, 4e-6), entry("mujoco", 1e-3, 1e-6), entry("mjx", 1e-3, 1e-6))
    report = CrosscheckReport("robot", 30.0, (0.0,) * 6, Tolerances(), comparisons)
    html, table = shown(report.to_dict())
    columns = columns_of(table)
    assert columns["simulator"] == ["MuJoCo", "MuJoCo", "MJX"]
    assert columns["step [ms]"] == ["2", "1", "1"]
    assert columns["base attitude [rad]"] == ["4e-06", "1e-06", "1e-06"]
    assert columns["linear momentum [N s]"] == ["4e-09"] * 3
    # Not a number in any row: no column.
    assert "angular momentum [N m s]" not in columns
    assert ('verdict met"' if report.passed else 'verdict missed"') in html
    assert report.sentence.split(":")[0] in html


def test_the_check_of_a_tracked_path_has_the_tool_and_relative_momenta():
    entries = (
        TrackedComparison("forces", 1e-3, 1e-9, 2e-9, 3e-9, 4e-9, 5e-9, 6e-12, 7e-12, 1.0),
        TrackedComparison("momentum", None, 1e-9, 2e-9, 3e-9, 4e-9, 5e-9, 6e-12, 7e-12, 1.0),
    )
    report = TrackedCheck("robot", 25.0, (0.0,) * 6, TrackedTolerances(), entries)
    columns = columns_of(shown(report.to_dict())[1])
    assert columns["simulator"] == ["MuJoCo, by torques and impulses", "MuJoCo, by the momentum equation"]
    assert columns["step [ms]"] == ["1", ""]
    assert columns["tool position [m]"] == ["4e-09"] * 2
    assert columns["linear momentum [relative]"] == ["6e-12"] * 2


def test_the_check_of_a_hold_is_a_row_for_each_run():
    check = HoldCheck(
        (HoldComparison("PD", 0.02, 0.021, 1e-5, 2e-5, 3e-7), HoldComparison("b", 1, 2, 3, 4, 5))
    )
    html, table = shown(check.to_dict())
    columns = columns_of(table)
    assert columns["run"] == ["PD", "b"]
    assert columns["base rate at the end, MuJoCo [rad/s]"][0] == "0.02"
    assert columns["the same, ours [rad/s]"][0] == "0.021"
    assert 'verdict missed"' in html


def test_the_check_of_a_capture_says_what_touched():
    report = ContactReport(
        "robot", 31.5, 2e-3, (Contact(("link3", "target"), 12.0, 0.004),), 1e-7, 2e-7, None, None, 3e-9
    )
    html, table = shown(CaptureCheck(report).to_dict())
    assert ["tool at the end", "1e-07", "m"] in table
    assert ["link3 and target touch at 12 s", "0.004", "m deep"] in table
    assert "31.5 s in steps of 2 ms" in html
    assert 'verdict missed"' in html
    assert not any("target at the end" in row[0] for row in table)
    # As the summary's file has it.
    assert asdict(report)["contacts"][0]["pair"] == ("link3", "target")


def test_a_robot_of_the_catalogue_has_its_own_limits_in_the_table():
    robot = jffsr.load_robot("servicer_7dof")
    columns = columns_of(tables_of(joints_table(robot, {}))[0])
    assert columns["rate limit [deg/s]"] == ["10", "10", "10", "10", "15", "15", "15"]
    assert columns["torque limit [N m]"][0] == "120"
