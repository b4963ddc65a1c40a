"""Measures of manipulability against their definitions, and the paper's beside what is meant."""

from __future__ import annotations

import chex
import jax
import numpy as np
import pytest

import jffsr
from jffsr.capture.manipulability import grasped_jacobian, manipulability
from jffsr.errors import InputError

STATE = jffsr.State(
    np.array([0.1, 0.2, -0.1]), np.array([0.8, 0.0, 0.6, 0.0]), np.deg2rad([10, -40, 20, 30, -15, -30, 25.0])
)
TURN = np.array([0.5, 0.5, -0.5, 0.5])


@pytest.fixture(scope="module")
def jacobians():
    """Of the tool, and of a target held at two grasp points."""
    robot = jffsr.load_robot("servicer_7dof")

    @jax.jit
    def all_three():
        kin = jffsr.kinematics(robot, STATE)
        held = [grasped_jacobian(robot, STATE, np.array(p), TURN) for p in ((-0.4, 0.1, 0.2), (1.0, -2.0, 0.5))]
        return jffsr.generalized_jacobian(robot, kin), *held

    return jax.device_get(all_three())


def test_the_target_moves_as_a_rigid_body_with_the_tool(jacobians):
    tool, held, _ = jacobians
    rates = np.linspace(-1, 1, 7)
    rotation = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    # R(TURN) by hand: w = x = z = 1/2, y = -1/2.
    w, x, y, z = TURN
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    to_centre = -rotation @ [-0.4, 0.1, 0.2]
    velocity, spin = (tool @ rates)[:3], (tool @ rates)[3:]
    np.testing.assert_allclose(held @ rates, [*(velocity + np.cross(spin, to_centre)), *spin], atol=1e-12)


def test_the_published_measure_does_not_see_the_grasp_point(jacobians):
    values = [float(manipulability(j, "published")) for j in jacobians]
    np.testing.assert_allclose(values, values[0], rtol=1e-10)
    np.testing.assert_allclose(values[0], np.prod(np.linalg.svd(jacobians[0])[1]), rtol=1e-10)


def test_the_force_measure_is_what_torques_of_unit_norm_can_hold(jacobians):
    _, held, other = jacobians
    wrench = np.array([0.3, -0.5, 0.2, 0.1, 0.0, 0.4])
    force = float(manipulability(held, "force", wrench))
    torque = held.T @ (force * wrench / np.linalg.norm(wrench))
    np.testing.assert_allclose(np.linalg.norm(torque), 1.0, rtol=1e-9)
    assert abs(float(manipulability(other, "force", wrench)) / force - 1) > 0.05


def test_scaling_velocity_up_lowers_force(jacobians):
    held = jacobians[1]
    assert manipulability(2 * held, "published") > manipulability(held, "published")
    assert manipulability(2 * held, "force") < manipulability(held, "force")


def test_the_least_singular_value_scales_lengths(jacobians):
    held = jacobians[1]
    scaled = np.diag([0.5, 0.5, 0.5, 1, 1, 1]) @ held
    np.testing.assert_allclose(
        manipulability(held, "least_singular_value", length=2.0), np.linalg.svd(scaled)[1][-1], rtol=1e-12
    )


@pytest.mark.parametrize("measure", ["published", "force", "least_singular_value"])
def test_gradients_are_finite_at_a_singularity_too(jacobians, measure):
    singular = jacobians[1].copy()
    singular[0] = singular[1]
    for matrix in (jacobians[1], singular, np.zeros((6, 7))):
        chex.assert_tree_all_finite(jax.grad(manipulability)(matrix, measure))


def test_an_unknown_measure_is_refused_with_the_nearest_name(jacobians):
    with pytest.raises(InputError, match="did you mean 'force'"):
        manipulability(jacobians[0], "forse")
