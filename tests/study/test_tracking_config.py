"""Bad tracking studies: the one sentence for every kind of mistake, before anything is tracked."""

from __future__ import annotations

import numpy as np
import pytest

from jffsr.errors import InputError
from jffsr.study.config import dump_config, load_config
from jffsr.study.planning import plan
from jffsr.study.sweep.points import expand
from jffsr.study.sweep.specification import read_sweep
from jffsr.study.tracking import schema_tracker
from jffsr.study.tracking.building import build_task, build_tracker, build_tuning
from jffsr.study.tracking.running import run_tracking
from jffsr.tracking.inverses import METHODS
from jffsr.tracking.limits import LIMIT_RULES
from jffsr.tracking.tool_task import FREEDOMS
from jffsr.tracking.tracker import FEEDFORWARDS
from jffsr.tracking.tuning import TUNABLE

CONFIG = "wu_2018"
GOAL = "{position: [1.5, 0, -0.2], angles: [-3.16, -0.26, -3.14]}"


def refused(*overrides: str) -> str:
    """What is said of the configuration, its robot and its path; nothing may be tracked or written."""
    with pytest.raises(InputError) as error:
        run_tracking(load_config(CONFIG, overrides), out="/nowhere/run")
    return str(error.value)


def test_names_are_those_of_the_package():
    fields = schema_tracker.Tracker.model_fields
    assert schema_tracker.METHODS == METHODS
    assert schema_tracker.TUNABLE == TUNABLE
    for name, allowed in (("limits", LIMIT_RULES), ("freedom", FREEDOMS), ("feedforward", FEEDFORWARDS)):
        assert fields[name].annotation.__args__ == allowed


def test_a_resolved_configuration_reads_as_an_equal_one(tmp_path):
    asked = ["compare.damped.substeps=2", "tuning={parameters: {epsilon: [0.01, 0.1]}, rate_limit_deg: 6}"]
    config = load_config(CONFIG, [*asked, "path.start=given"])
    (tmp_path / "again.yaml").write_text(dump_config(config))
    again = load_config(tmp_path / "again.yaml")
    assert again == config
    assert again.trackers["damped"].substeps == 2
    assert again.trackers["inverse"].substeps == 1
    assert build_tuning(again, build_task(again)).names == ("epsilon",)


def test_the_path_begins_where_the_tool_is_or_where_it_is_told():
    actual, given = (build_task(load_config(CONFIG, [f"path.start={s}"])) for s in ("actual", "given"))
    apart = np.asarray(actual.target(0.0).position) - np.asarray(given.target(0.0).position)
    np.testing.assert_allclose(given.target(0.0).position, [1.37, -0.08, 0.64], atol=1e-15)
    # The tool of the oracle file is 4.4 mm from the printed start.
    assert np.linalg.norm(apart) == pytest.approx(4.4e-3, abs=5e-5)


@pytest.mark.parametrize(
    ("overrides", "sentence"),
    [
        (
            ["kind=trackin"],
            "found 'trackin', 'planning', 'tracking', 'capture', 'reactionless' or 'chain' is expected; "
            "did you mean 'tracking'?",
        ),
        (["tracker.method=adaptve"], "tracker.method: found 'adaptve', "),
        (["compare.damped.metod=x"], "compare.damped.metod: unknown key; did you mean 'method'?"),
        (["path.order=XYY"], "path.order: found 'XYY', three axes such as 'ZYX'"),
        (["path.via=[1, 2, 3]"], "path.via: the path 'line' has no such key, leave it out"),
        (["path.order=null"], "path.order: missing, poses with angles need an order such as 'ZYX'"),
        ([f"path.poses=[{GOAL}, {GOAL}, {GOAL}]"], "path.poses: found 3 poses, 2 are expected"),
        (["path.poses.0.quaternion=[1, 0, 0, 0]"], "found quaternion and angles, either "),
        (["timing.kind=quintic"], "timing.ramp_fraction: the timing 'quintic' has no such key, leave it out"),
        (["timing.kind=fastest", "timing.ramp_fraction=null"], "'fastest' has no such key, leave it out"),
        (["timing.duration=null"], "timing.duration: missing, a duration in s is required"),
        (["tuning={parameters: {lambda_mx: [1, 2]}, rate_limit: 1}"], "did you mean 'lambda_max'?"),
        (["tuning={parameters: {epsilon: [2, 1]}, rate_limit: 1}"], "found [2, 1], low < high is expected"),
        (["task.base_mode=fixed", "task.linear_momentum=[1, 0, 0]"], "base_mode 'fixed' does not keep it"),
        (["tracker.secondary=[{task: base_attitud}]"], "did you mean 'base_attitude'?"),
        (["tracker.secondary=[{task: joint_limits}]"], "found 0, the task 'joint_limits' does nothing"),
        (["limits.position_deg=[[10, -10]]"], "a pair [low, high] with low < high is expected"),
    ],
)
def test_a_wrong_value_is_told_with_its_key(overrides, sentence):
    assert sentence in refused(*overrides)


def with_poses(start: str, goal: str = GOAL, order: str = "-xyz") -> list[str]:
    return [f"path.order={order}", f"path.poses=[{start}, {goal}]"]


@pytest.mark.parametrize(
    ("overrides", "sentence"),
    [
        (
            with_poses("{position: [1.39, -0.08, 0.64], angles: [-3.14, 0, -2.97]}"),
            "path.poses.0: the path starts 18.8 mm and 0.192 deg from the tool, which is at [1.3717, -0.0763, 0.6415] "
            "m; path.start_tolerance allows 10 mm and 1 deg",
        ),
        (
            with_poses("{position: [1.37, -0.08, 0.64], angles: [-3.14, 0.1, -2.97]}"),
            "deg from the tool, which is at",
        ),
        (
            with_poses(
                "{position: [1.37, -0.08, 0.64], quaternion: [2, 0, 0, 0]}",
                "{position: [1.5, 0, -0.2], quaternion: [1, 0, 0, 0]}",
                "null",
            ),
            "(2.0, 0.0, 0.0, 0.0) has the length 2; a unit quaternion is expected",
        ),
        (
            with_poses(
                "{position: [1.37, -0.08, 0.64], angles: [-3.14, 0, -2.97]}",
                "{position: [9, 0, 0], angles: [-3.14, 0, -2.97]}",
            ),
            "path: unreachable: at",
        ),
        (["timing.duration=25.1"], "the duration is 25.1 s; a whole number of periods of 0.25 s is expected"),
        (
            ["tracker.position_gain=9"],
            "tracker.position_gain is 9 1/s, which is unstable with rates held over",
        ),
        (["task.start_deg=[0, 0]"], "task.start_deg: found a list of 2, robot 'wu_2018_6dof' has 6 joints"),
        (["limits.position_deg=100"], "lies outside its range"),
        (
            ["timing={kind: fastest, duration: null, ramp_fraction: null}", "task.linear_momentum=[1, 0, 0]"],
            "timing.kind: found 'fastest', which needs zero momentum",
        ),
        (
            ["timing={kind: fastest, duration: null, ramp_fraction: null}"],
            "robot 'wu_2018_6dof' has joints without a rate limit",
        ),
        (["task.end_effector=hand"], "task.end_effector: found 'hand', robot 'wu_2018_6dof' has tool"),
        (
            ["path.kind=call", "path.poses=null", "path.call=no_such.path"],
            "'no_such.path' cannot be imported",
        ),
    ],
)
def test_what_does_not_fit_the_robot_is_told(overrides, sentence):
    told = refused(*overrides)
    assert sentence in told
    assert told.startswith(("configs/tracking/wu_2018.yaml:", "override"))


def test_other_commands_say_that_they_plan():
    with pytest.raises(InputError, match=r"found 'tracking'; use 'jffsr run', or jffsr\.track in Python"):
        plan(CONFIG)
    with pytest.raises(InputError, match="only planning studies are swept over"):
        expand(read_sweep(CONFIG, ["timing.duration=15,25"]))


def test_a_tracker_of_the_study_is_one_of_the_package():
    config = load_config(CONFIG, ["tracker.secondary=[{task: base_attitude, gain: 1, decoupled: true}]"])
    tracker = build_tracker(config.trackers["adaptive"])
    assert tracker.lambda_max == 0.0571
    assert tracker.secondary[0].decoupled
