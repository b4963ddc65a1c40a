"""The section `constraints`: what it gives, and the sentence for every mistake in it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from config_files import GOOD, folder, load  # noqa: F401 (the fixture acts by being here)

from jffsr.errors import InputError
from jffsr.objectives.constraints import BaseExcursion, FinalAttitude, JointLimits
from jffsr.planning.result import torque_unseen
from jffsr.study.building import build_problem
from jffsr.study.config import dump_config
from jffsr.study.schema import PlanningConfig

PLANAR = """\
kind: planning
robot: hu_2011_planar2
task: {start_deg: [90, 30], goal_deg: [-60, 90], duration: 20}
limits: {position_deg: 324, rate: 0.25, acceleration: 0.2, base_excursion_deg: 40}
"""


def test_none_by_default():
    config = load(PLANAR)
    assert build_problem(config).constraints == ()
    assert config.constraints.final_attitude is None


def test_all_three_are_built():
    text = "constraints: {final_attitude: {angle_deg: 30}, joint_limits: {rate: false}, base_excursion: {}}\n"
    config = load(PLANAR + text + "objective: {attitude_measure: euler_zxy}\n")
    attitude, joints, excursion = build_problem(config).constraints
    assert isinstance(attitude, FinalAttitude)
    np.testing.assert_allclose(attitude.goal, [math.cos(math.pi / 12), 0, 0, math.sin(math.pi / 12)])
    assert attitude.tolerance == 1e-8
    assert isinstance(joints, JointLimits)
    assert joints.velocity is None
    np.testing.assert_array_equal(joints.acceleration, 0.2)
    np.testing.assert_allclose(joints.position_upper, math.radians(324))
    assert isinstance(excursion, BaseExcursion)
    np.testing.assert_allclose(excursion.limit, math.radians(40))
    assert excursion.measure == "euler_zxy"


def test_goal_may_be_a_quaternion_or_an_angle_in_rad():
    given = load(PLANAR + "constraints: {final_attitude: {goal: [0, 1, 0, 0], tolerance: 1e-6}}\n")
    assert given.constraints.final_attitude.quaternion == (0, 1, 0, 0)
    turned = load(PLANAR + "constraints: {final_attitude: {angle: 0.5}}\n")
    np.testing.assert_allclose(
        turned.constraints.final_attitude.quaternion, [math.cos(0.25), 0, 0, math.sin(0.25)]
    )


@pytest.mark.parametrize(
    ("joints", "said"),
    [
        # The second link, a tube of radius 0.05 m, folds back to the base: its rim is 1 + cos - 0.05 sin from it.
        (
            "start_deg: [0, 165], goal_deg: [0, 90]",
            r":3: task.start_deg: base and link2 are 0.02113 m apart at the start",
        ),
        (
            "start: [0, 1.5], goal: [0, 2.87979327]",
            r":3: task.goal: base and link2 are 0.02113 m apart at the goal",
        ),
    ],
)
def test_bodies_too_near_at_either_end_are_told(joints, said):
    text = PLANAR.replace("start_deg: [90, 30], goal_deg: [-60, 90]", joints)
    config = load(text + "constraints: {clearance: {margin: 0.03}}\n")
    with pytest.raises(
        InputError, match=f"{said}; at least 'constraints.clearance.margin' is expected, 0.03 m"
    ):
        build_problem(config)
    build_problem(load(text + "constraints: {clearance: {margin: 0.0212, tolerance: 1e-4}}\n"))


def test_written_out_and_read_again_is_the_same():
    config = load(PLANAR + "constraints: {final_attitude: {angle_deg: 30}, joint_limits: {}}\n")
    again = load(dump_config(config))
    assert isinstance(again, PlanningConfig)
    assert again == config


KEYS = "the keys here are final_attitude, joint_limits, base_excursion, torque_limit, clearance"
ONE = "one of 'goal' (w, x, y, z), 'angle_deg' and 'angle' is expected"
MISTAKES = {
    "constraints: {final_atitude: {angle: 0}}\n": "x.yaml:7: constraints.final_atitude: unknown key; "
    "did you mean 'final_attitude'?",
    "constraints: {zzz: {angle: 0}}\n": f"x.yaml:7: constraints.zzz: unknown key; {KEYS}",
    "constraints: {final_attitude: {}}\n": f"x.yaml:7: constraints.final_attitude.goal: missing, {ONE}",
    "constraints: {final_attitude: {goal: [1, 0, 0, 0], angle: 1}}\n": "x.yaml:7: "
    f"constraints.final_attitude.goal: both 'goal' and an angle are given, {ONE}",
    "constraints: {final_attitude: {angle_deg: 190}}\n": "x.yaml:7: constraints.final_attitude.angle_deg: "
    "found 190, a number in [-180, 180] deg or null is expected",
    "constraints: {final_attitude: {goal: [1, 1, 0, 0]}}\n": "x.yaml:7: constraints.final_attitude.goal: "
    "found [1, 1, 0, 0], a quaternion (w, x, y, z) of norm 1 within 0.001, not 1.41421, is expected",
    "constraints: {final_attitude: {angle: 0, tolerance: 0}}\n": "x.yaml:7: "
    "constraints.final_attitude.tolerance: found 0, a number > 0 is expected",
    "constraints: {joint_limits: {position: no, rate: no, acceleration: no}}\n": "x.yaml:7: "
    "constraints.joint_limits: every quantity is switched off, at least one is expected",
    "constraints: {base_excursion: {}}\n": "x.yaml:7: constraints.base_excursion: given, but "
    "'limits.base_excursion_deg' (or 'base_excursion', in rad) is not",
}


@pytest.mark.parametrize("added", MISTAKES)
def test_sentence_of_a_mistake(added):
    with pytest.raises(InputError) as caught:
        load(GOOD + added)
    assert str(caught.value) == MISTAKES[added]


@pytest.mark.parametrize(
    ("asked", "unseen"),
    [
        ("", True),
        ("objective: {joint_torque: {enabled: true}}\n", False),
        ("constraints: {torque_limit: {}}\n", False),
    ],
)
def test_torque_limits_of_the_robot_are_looked_at_where_it_is_asked(asked, unseen):
    """As the summary advises: the servicer has limits of torque of its own."""
    task = "task: {start_deg: [0, -60, 0, 45, 0, -15, 0], goal_deg: [20, -40, 10, 60, 0, -30, 10], duration: 30}\n"
    problem = build_problem(
        load(f"kind: planning\nrobot: servicer_7dof\n{task}limits: {{acceleration: 0.2}}\n{asked}")
    )
    assert torque_unseen(problem) == unseen
    assert problem.needs_torque != unseen
