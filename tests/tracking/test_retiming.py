"""The fastest timing under a robot's limits: against the closed form of one link, and the limits of six axes."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import wu_path

from jffsr.dynamics.base_mode import FIXED
from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.errors import InputError
from jffsr.robots.builder import build_robot
from jffsr.robots.loading import describe_robot
from jffsr.robots.robot import Limits
from jffsr.tracking.retiming import fastest_tracking, stretched
from jffsr.tracking.tracker import Tracker
from jffsr.trajectories.cartesian.arc import Arc

RATE, ACCELERATION, TURN = 0.2, 0.1, 1.2
FAST = Tracker(method="inverse", freedom="position")


@pytest.fixture(scope="module")
def link():
    """Base and one link that turns about z."""
    whole = describe_robot("hu_2011_planar2")
    tool = dataclasses.replace(whole.end_effectors[0], link=whole.links[1].name)
    robot = build_robot(
        dataclasses.replace(
            whole, links=whole.links[:2], joints=whole.joints[:1], end_effectors=(tool,), shapes=()
        )
    )
    limits = Limits.symmetric(position=3.0, velocity=RATE, acceleration=ACCELERATION, num_joints=1)
    return robot.replace(limits=limits)


@pytest.fixture(scope="module")
def start():
    return wu_path.state_at([0.3])


@pytest.fixture(scope="module")
def arc(link, start):
    kin = kinematics(link, start)
    pose = end_effector_pose(link, kin)
    return Arc.about(np.asarray(kin.anchor[0]), [0, 0, 1], tuple(map(np.asarray, pose)), TURN)


def test_one_link_takes_the_time_of_its_trapezoid(link, start, arc):
    """With the base held the joint's angle is the path's: it ramps up, turns at its limit and ramps down."""
    timing = fastest_tracking(link, arc, start, FAST, margin=0.0, steps=100, base_mode=FIXED)
    assert float(timing.duration) == pytest.approx(TURN / RATE + RATE / ACCELERATION, rel=1e-3)
    slower = fastest_tracking(link, arc, start, FAST, margin=0.2, steps=100, base_mode=FIXED)
    assert float(slower.duration) == pytest.approx(TURN / (0.8 * RATE) + RATE / ACCELERATION, rel=1e-3)


def test_a_timing_is_stretched_to_whole_periods(link, start, arc):
    timing = fastest_tracking(link, arc, start, FAST, margin=0.0, steps=100, base_mode=FIXED)
    assert float(stretched(timing, 0.25).duration) == pytest.approx(8.25, rel=1e-12)
    whole = stretched(timing.to_last(8.0), 0.25)
    assert float(whole.duration) == pytest.approx(8.0, rel=1e-12)


def test_what_has_no_fastest_timing_is_refused(link, start, arc):
    with pytest.raises(InputError, match=r"margin is 1; a number in \[0, 1\) is expected"):
        fastest_tracking(link, arc, start, FAST, margin=1.0)
    endless = link.replace(limits=dataclasses.replace(link.limits, velocity=np.array([np.inf])))
    with pytest.raises(InputError, match="has joints without a rate limit"):
        fastest_tracking(endless, arc, start, FAST)
