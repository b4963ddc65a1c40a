"""What is no target, no state and no grasp frame is refused in one sentence."""

from __future__ import annotations

import jax
import numpy as np
import pytest

from jffsr.errors import InputError
from jffsr.robots.geometry import Shape
from jffsr.robots.rigid_body import RigidBody
from jffsr.target.body import Target
from jffsr.target.target_state import TargetState
from jffsr.target.tumbling import target_motion

REST = np.zeros(3)
UNIT = (1.0, 0.0, 0.0, 0.0)


def test_an_inertia_that_no_body_has_is_refused_with_its_numbers():
    with pytest.raises(
        InputError, match=r"target 'rocket': .*\(0.2, 0.3, 1\).*triangle.*0.2 \+ 0.3 is less than 1"
    ):
        Target.create((1.0, 0.2, 0.3), name="rocket")
    with pytest.raises(InputError, match="all must be positive"):
        Target.create((1.0, -0.2, 0.9))
    with pytest.raises(InputError, match=r"inertia has shape \(2,\)"):
        Target.create((1.0, 0.2))
    with pytest.raises(InputError, match="mass is 0 kg"):
        Target.create((1.0, 1.0, 1.0), mass=0.0)


def test_frames_are_checked():
    with pytest.raises(InputError, match=r"grasp 'ring': shapes \(2,\)"):
        Target.create((1.0, 1.0, 1.0), grasps={"ring": ((0, 0), UNIT)})
    with pytest.raises(InputError, match=r"marker: quaternion .* off unit length by 1"):
        Target.create((1.0, 1.0, 1.0), marker=(REST, (2.0, 0, 0, 0)))
    with pytest.raises(InputError, match=r"position .* is not finite"):
        Target.create((1.0, 1.0, 1.0), marker=((np.nan, 0, 0), UNIT))
    target = Target.create((1.0, 1.0, 1.0), grasps={"ring": (REST, UNIT)})
    with pytest.raises(InputError, match="grasp 'rign' does not exist; there are: ring; did you mean 'ring'"):
        target.grasp_index("rign")
    with pytest.raises(InputError, match="there are: none"):
        Target.create((1.0, 1.0, 1.0)).grasp_index()


def test_states_are_checked_and_printed_quaternions_normalised():
    with pytest.warns(UserWarning, match="off unit length by 0.014"):
        state = TargetState.create(REST, REST, np.array([0.6, 0.8, 0, 0]) * 1.014, REST)
    np.testing.assert_allclose(state.quaternion, [0.6, 0.8, 0, 0], atol=1e-15)
    with pytest.raises(InputError, match=r"velocity .* is not finite"):
        TargetState.create(REST, (np.inf, 0, 0), UNIT, REST)
    with pytest.raises(InputError, match=r"quaternion has shape \(3,\)"):
        TargetState.create(REST, REST, REST, REST)


def test_a_motion_without_duration_or_number_of_steps_is_refused():
    target = Target.create((1.0, 0.9, 0.8))
    state = TargetState.create(REST, REST, UNIT, (0.1, 0.2, 0.3))
    with pytest.raises(InputError, match="duration is -1 s"):
        target_motion(target, state, -1.0)
    with pytest.raises(InputError, match="num_steps must be given"):
        jax.eval_shape(lambda time: target_motion(target, state, time).quaternion, 1.0)
    with pytest.raises(InputError, match="steps"):
        target_motion(target, state, 1e9)


def test_a_rigid_body_becomes_a_target_about_its_centre_of_mass():
    shape = Shape("bus", "sphere", "", np.array([0.0, 0, 1]), np.eye(3), np.array([0.5]))
    body = RigidBody.create(50.0, (3.0, 2.0, 2.0), (0.1, 0.2, 0.3), "satellite", [shape])
    half = np.sqrt(0.5)
    marker = ((0.1, 0.2, 1.3), (half, half, 0, 0))
    target = Target.of_body(body, marker, {"ring": ((1.1, 0.2, 0.3), UNIT)})
    np.testing.assert_allclose(target.grasp_position, [[1.0, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(target.marker_position, [0, 0, 1], atol=1e-15)
    np.testing.assert_allclose(
        target.geometry.on_body("satellite")[0].position, [-0.1, -0.2, 0.7], atol=1e-15
    )
    # From the marker, turned by 90 degrees about x: the ring is 1 m along x and 1 m down z, the marker's -y... y is z.
    position, quaternion = target.grasp_in_marker("ring")
    np.testing.assert_allclose(position, [1.0, -1.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(quaternion, [half, -half, 0, 0], atol=1e-15)
