"""The response of base and tool against the readable dynamics: joints that turn and slide, base modes, derivatives."""

from __future__ import annotations

import jax
import numpy as np
import pytest
import wu_path

from jffsr.dynamics.kinematics import jacobians, kinematics
from jffsr.dynamics.momentum import base_twist, generalized_jacobian
from jffsr.robots.state import State
from jffsr.tracking.free_base import response

PUSH = np.array([2.0, -4.0, 1.0, 1.6, -1.2, 2.2])


@pytest.mark.parametrize("base_mode", ["floating", "attitude_held", "fixed"])
@pytest.mark.parametrize(("name", "tool"), [("two_arms", "right"), ("wu_2018_6dof", "tool")])
def test_response_is_that_of_the_readable_dynamics(robots, name, tool, base_mode):
    robot = robots[name]
    draw, n = np.random.default_rng(0), robot.num_joints
    state = wu_path.state_at(draw.uniform(-2, 2, n), (0.3, -1.0, 2.0), np.array([0.8, -0.2, 0.4, 0.4]))
    rate, direction = draw.normal(size=n), draw.normal(size=n)

    def found(q):
        kin = kinematics(robot, State(state.base_position, state.base_quaternion, q))
        answer = response(robot, kin, PUSH, tool, base_mode)
        return answer, answer.base_twist(rate)

    def readable(q):
        kin = kinematics(robot, State(state.base_position, state.base_quaternion, q))
        twist = base_twist(robot, kin, rate, PUSH, base_mode)
        still = base_twist(robot, kin, 0 * rate, PUSH, base_mode)
        jacobian = generalized_jacobian(robot, kin, tool, base_mode)
        return jacobian, jacobians(robot, kin, tool)[0] @ still, twist, still

    (answer, twist), (slope, twist_slope) = jax.jvp(found, (state.joint_position,), (direction,))
    expected, expected_slope = jax.jvp(readable, (state.joint_position,), (direction,))
    for ours, moved, theirs in (
        (answer, twist, expected),
        (slope, twist_slope, expected_slope),
    ):
        for a, b in zip((ours.jacobian, ours.drift, moved, ours.base_drift), theirs, strict=True):
            np.testing.assert_allclose(a, b, atol=2e-14)
