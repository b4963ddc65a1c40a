"""The target that an estimate stands for, against the true one; a motion followed backwards."""

from __future__ import annotations

from dataclasses import replace

import chex
import numpy as np
import pytest

from jffsr.robots.geometry import BOX, Geometry, Shape
from jffsr.spatial.rotation import quaternion_to_matrix
from jffsr.target.body import Target
from jffsr.target.estimate import true_estimate
from jffsr.target.estimated import estimated_target
from jffsr.target.grasp_frames import grasp_frame
from jffsr.target.target_state import TargetState
from jffsr.target.tumbling import state_before, target_motion

HALF = np.array([0.3, 0.25, 0.2])
CORNERS = HALF * np.array([[1, 1, 1], [-1, 1, 1], [1, -1, 1], [1, 1, -1]])


@pytest.fixture(scope="module")
def target():
    box = Shape("hull", BOX, "target", np.array([0.05, 0.0, -0.02]), np.eye(3), HALF)
    return Target.create(
        np.diag([10.0, 13.0, 15.0]) + 0.5,
        300.0,
        ((0.2, -0.1, 0.3), (0.5, 0.1, -0.7, 0.5)),
        {"handle": ((-0.4, 0.1, 0.0), (0.8, 0.0, 0.6, 0.0))},
        geometry=Geometry((box,)),
    )


@pytest.fixture(scope="module")
def state():
    return TargetState.create((2.4, 0.0, -0.5), (0.01, 0.0, -0.02), (0.8, 0.0, 0.6, 0.0), (0.1, 0.05, 0.02))


def test_the_truth_as_an_estimate_is_the_same_body(target, state):
    """Grasp frame and corners of the shape are where they were, now and later."""
    estimate = true_estimate(target, state)
    found = estimated_target(target, estimate)
    assert found.grasp_names == target.grasp_names
    moved, before = (
        target_motion(body, at, 8.0, 8)(8.0) for body, at in ((found, estimate.state), (target, state))
    )
    np.testing.assert_allclose(moved.position, before.position, atol=1e-12)
    for a, b in zip(grasp_frame(found, moved), grasp_frame(target, before), strict=True):
        # A quaternion and its opposite are one attitude.
        sign = np.sign(np.vdot(a, b)) if np.shape(a) == (4,) else 1.0
        np.testing.assert_allclose(a, sign * b, atol=1e-9)
    corners = [
        np.asarray(place.position)
        + (shape.position + CORNERS @ shape.rotation.T) @ np.asarray(quaternion_to_matrix(place.quaternion)).T
        for body, place in ((found, moved), (target, before))
        for shape in body.geometry.shapes
    ]
    np.testing.assert_allclose(*corners, atol=1e-9)


def test_a_wrong_centre_of_mass_moves_no_handle_now(target, state):
    estimate = true_estimate(target, state)
    wrong = replace(estimate, marker_offset_T=estimate.marker_offset_T + np.array([0.02, -0.01, 0.03]))
    found = estimated_target(target, wrong)
    place, _, _ = grasp_frame(found, wrong.state)
    np.testing.assert_allclose(place, grasp_frame(target, state)[0], atol=1e-12)
    assert np.linalg.norm(wrong.state.position - state.position) > 0.03


def test_a_state_before_leads_to_the_state(target, state):
    before = state_before(target, state, 12.0)
    assert np.linalg.norm(before.angular_velocity_T - state.angular_velocity_T) > 1e-3
    again = target_motion(target, before, 12.0)(12.0)
    sign = np.sign(np.vdot(again.quaternion, state.quaternion))
    np.testing.assert_allclose(again.quaternion, sign * state.quaternion, atol=1e-12)
    chex.assert_trees_all_close(
        (again.position, again.velocity, again.angular_velocity_T),
        (state.position, state.velocity, state.angular_velocity_T),
        atol=1e-12,
    )
