"""The index as a sum: weights, switches, names, and its smooth form's limit."""

from __future__ import annotations

import jax
import numpy as np
import pytest
from wu6_problems import GOAL, limited

from jffsr.errors import InputError
from jffsr.objectives.composite import composite_index
from jffsr.objectives.smoothing import Smoothing
from jffsr.objectives.terms import UserTerm

TURN = np.array([np.cos(0.1), 0.0, 0.0, np.sin(0.1)])
ALL_ON = {
    "goal_quaternion": TURN,
    "attitude_change": np.deg2rad(0.1),
    "excursion_limit": np.deg2rad(10),
    "tool_position": 1e-3,
}


@pytest.fixture(scope="module")
def robot(robots):
    return limited(robots["wu_2018_6dof"])


def names(index) -> list[str]:
    return [term.name for term in index.terms]


def test_index_of_a_known_motion(robot, make_motion):
    """Turned by 0.3 rad about z, a peak rate of 0.3 rad/s and a peak acceleration of 0.25 rad/s^2 at one joint."""
    angles = np.linspace(0, 0.3, 5)
    quaternions = np.stack([np.cos(angles / 2), 0 * angles, 0 * angles, np.sin(angles / 2)], axis=1)
    velocity, acceleration = np.zeros((9, 6)), np.zeros((9, 6))
    velocity[3, 1], acceleration[5, 4] = -0.3, 0.25
    motion = make_motion(quaternions, None, velocity, acceleration)
    index = composite_index(robot, joint_goal=GOAL, excursion_limit=[0.1, 0.1, 0.2])
    parts = index.breakdown(robot, motion)
    expected = {
        "attitude_change": (0.3, 0.3 / np.deg2rad(0.1)),
        "joint_rate": (0.2, 20.0),
        "joint_acceleration": (0.25, 25.0),
        "attitude_excursion": (0.5, 50.0),
    }
    assert {k: (float(v.value), float(v.weighted)) for k, v in parts.items()} == {
        k: pytest.approx(v, rel=1e-12) for k, v in expected.items()
    }
    total = sum(weighted for _, weighted in expected.values())
    assert index.value(robot, motion) == pytest.approx(total, rel=1e-12)


def test_each_term_divides_by_its_own_scale(robot, tumbling):
    index = composite_index(robot, joint_goal=GOAL, joint_rate=0.5, joint_acceleration=4.0, **ALL_ON)
    parts = jax.jit(lambda motion: index.breakdown(robot, motion))(tumbling)
    scales = {term.name: float(term.scale) for term in index.terms}
    assert scales["joint_rate"] == 0.5
    assert scales["tool_position"] == 1e-3
    assert scales["goal_attitude"] == 1e-3
    for name, part in parts.items():
        assert part.weighted == pytest.approx(float(part.value) / scales[name], rel=1e-14)


def test_goal_attitude_replaces_the_start_by_default(robot):
    """The printed index counts the attitude twice, and the two conflict: only one is on unless asked for."""
    assert "attitude_change" in names(composite_index(robot, joint_goal=GOAL))
    assert "goal_attitude" not in names(composite_index(robot, joint_goal=GOAL))
    with_goal = names(composite_index(robot, joint_goal=GOAL, goal_quaternion=TURN))
    assert "goal_attitude" in with_goal
    assert "attitude_change" not in with_goal
    both = composite_index(robot, joint_goal=GOAL, goal_quaternion=TURN, attitude_change=0.01)
    assert {"goal_attitude", "attitude_change"} <= set(names(both))


@pytest.mark.parametrize(
    "name",
    [
        "attitude_change",
        "joint_rate",
        "joint_acceleration",
        "attitude_excursion",
        "goal_attitude",
        "tool_position",
    ],
)
def test_each_term_can_be_switched_off(robot, name):
    everything = names(composite_index(robot, joint_goal=GOAL, **ALL_ON))
    assert len(everything) == 6
    without = names(composite_index(robot, joint_goal=GOAL, **(ALL_ON | {name: None})))
    assert without == [other for other in everything if other != name]


def test_excursion_needs_a_limit(robot):
    assert "attitude_excursion" not in names(composite_index(robot, joint_goal=GOAL))


def test_tool_goal_takes_the_desired_attitude(robot):
    start = np.array([0.0, 1.0, 0.0, 0.0])
    for goal, expected in ((None, start), (TURN, TURN)):
        index = composite_index(
            robot, joint_goal=GOAL, initial_quaternion=start, goal_quaternion=goal, tool_position=1e-3
        )
        np.testing.assert_array_equal(index.terms[-1].attitude, expected)


def test_refusals(robot):
    off = dict.fromkeys(("attitude_change", "joint_rate", "joint_acceleration"))
    with pytest.raises(InputError, match="every term of the objective is switched off"):
        composite_index(robot, joint_goal=GOAL, **off)
    mine = UserTerm(np.array(1.0), lambda robot, motion: 0.0, "joint_rate")
    with pytest.raises(InputError, match="two terms of the objective are named 'joint_rate'"):
        composite_index(robot, joint_goal=GOAL, extra=[mine])
    with pytest.raises(InputError, match="no end effector 'gripper'"):
        composite_index(robot, joint_goal=GOAL, tool_position=1e-3, end_effector="gripper")


def test_users_own_term_is_summed_and_reported(robot, tumbling):
    mine = UserTerm(np.array(0.5), lambda robot, motion: 3.0 * motion.time[-1], "mine")
    plain = composite_index(robot, joint_goal=GOAL)
    index = composite_index(robot, joint_goal=GOAL, extra=[mine])
    assert index.breakdown(robot, tumbling)["mine"].weighted == pytest.approx(6.0)
    assert index.value(robot, tumbling) == pytest.approx(float(plain.value(robot, tumbling)) + 6.0)


def test_smooth_index_tends_to_the_published_one(robot, tumbling):
    index = composite_index(robot, joint_goal=GOAL, smoothing=Smoothing(2.0, 0.02, 0.02), **ALL_ON)

    @jax.jit
    def differences(motion, looseness):
        value = index.value(robot, motion)
        return jax.vmap(lambda x: index.smooth(robot, motion, x) - value)(looseness)

    looseness = np.array([1.0, 0.5, 0.25, 0.125, 1 / 16, 1e-3])
    size = np.abs(np.asarray(differences(tumbling, looseness)))
    assert np.all(size[1:] < 0.7 * size[:-1])
    assert size[-1] < 1e-2 * size[0]
