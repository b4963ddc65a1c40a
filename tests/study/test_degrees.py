"""Degrees are refused for joints that slide, in studies and in robot files, with the line."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from config_files import folder, load, write  # noqa: F401 (the fixture acts by being here)

from jffsr.errors import InputError
from jffsr.robots.loading import load_robot
from jffsr.study.building import build_problem, build_robot

TREE = Path(__file__).parents[1] / "data" / "robots" / "tree_prismatic.yaml"
STUDY = f"""\
kind: planning
robot: {TREE}
limits: {{position: {{turn: [-3, 3], twist: [-3, 3], bend: [-3, 3]}}}}
task:
  start: [0, 0, 0, 0]
  goal: [0.1, 0.2, 0.1, 0.1]
  duration: 30
"""


@pytest.mark.parametrize(
    ("right", "wrong", "told"),
    [
        ("start: [", "start_deg: [", "x.yaml:5: task.start_deg: joint 'slide' slides, and is not given in degrees"),
        ("goal: [", "goal_deg: [", "x.yaml:6: task.goal_deg: joint 'slide' slides"),
        ("limits: {", "limits: {rate_deg: 3, ", "x.yaml:3: limits.rate_deg: joint 'slide' slides"),
        ("limits: {", "limits: {rate_deg: {slide: 3}, ", "x.yaml:3: limits.rate_deg: joint 'slide' slides"),
    ],
)  # fmt: skip
def test_a_study_refuses_them(right, wrong, told):
    with pytest.raises(InputError, match=re.escape(told)):
        build_problem(load(STUDY.replace(right, wrong)))


def test_joints_that_turn_may_be_given_in_degrees_beside_one_that_slides():
    robot = build_robot(load(STUDY.replace("limits: {", "limits: {rate_deg: {turn: 180}, ")))
    assert dict(zip(robot.joint_names, robot.limits.velocity, strict=True))["turn"] == pytest.approx(
        3.14159265
    )


@pytest.mark.parametrize(
    ("limits", "told"),
    [
        ("{position_deg: [-1, 1]}", "joints.1.limits.position_deg: given, but the joint slides; give 'position'"),
        ("{position: [-1, 1], rate_deg: 5}", "joints.1.limits.rate_deg: given, but the joint slides"),
        ("{rate: 1, rate_deg: 1}", "joints.1.limits.rate: both 'rate_deg' and 'rate' are given, keep one"),
    ],
)  # fmt: skip
def test_a_robots_file_refuses_them(limits, told):
    name = write("robot.yaml", TREE.read_text().replace("{position: [-0.5, 0.5]}", limits))
    with pytest.raises(InputError, match=r"robot\.yaml:\d+: " + re.escape(told)):
        load_robot(name)
