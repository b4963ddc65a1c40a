"""Euler angles: SciPy's numbers in all 24 orders, gimbal lock, the paper's transposed matrix, refusals."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jffsr.errors import InputError
from jffsr.spatial.euler import EULER_ORDERS, euler_to_quaternion, quaternion_to_euler
from jffsr.spatial.rotation import axis_angle_to_matrix, quaternion_to_matrix

WEIGHTS = np.array([1.0, 2.0, -0.7])
AXES = dict(zip("XYZxyz", np.tile(np.eye(3), (2, 1)), strict=True))


@jax.jit
def all_orders(angles, q):
    """Quaternions of angles and angles of quaternions, in every order."""
    return [(euler_to_quaternion(angles, order), quaternion_to_euler(q, order)) for order in EULER_ORDERS]


@jax.jit
def gradients(q):
    """Gradients (4, 4) of all the angles together, for one order of each parity, kind and reading."""
    orders = ("ZYX", "XZY", "ZXZ", "XZX", "xyz", "zyx", "yzy", "yxy")
    total = {o: jax.vmap(jax.grad(lambda q, o=o: quaternion_to_euler(q, o) @ WEIGHTS)) for o in orders}
    return {order: function(q) for order, function in total.items()}


def random_sets(seed=5, count=12):
    rng = np.random.default_rng(seed)
    quaternions = rng.normal(size=(count, 4))
    return rng.uniform(-4, 4, (count, 3)), quaternions / np.linalg.norm(quaternions, axis=1)[:, None]


def test_there_are_24_orders():
    assert len(set(EULER_ORDERS)) == 24


def test_all_orders_are_scipys():
    angles, quaternions = random_sets()
    rotations = Rotation.from_quat(quaternions, scalar_first=True)
    for order, (q, found) in zip(EULER_ORDERS, all_orders(angles, quaternions), strict=True):
        expected = Rotation.from_euler(order, angles).as_matrix()
        np.testing.assert_allclose(quaternion_to_matrix(q), expected, rtol=0, atol=2e-15, err_msg=order)
        np.testing.assert_allclose(found, rotations.as_euler(order), rtol=0, atol=1e-13, err_msg=order)
        np.testing.assert_allclose(
            quaternion_to_euler(-quaternions[0], order), found[0], rtol=0, atol=1e-13, err_msg=order
        )


def test_gimbal_lock_gives_the_same_attitude_and_finite_gradients():
    """Both locks of an order, exactly and within rounding; then the third angle is zero."""
    for order in EULER_ORDERS:
        repeated = order[0] == order[2]
        locks = np.array([0, np.pi] if repeated else [-np.pi / 2, np.pi / 2])
        angles = np.array(
            [[0.7, lock, 1.1] for lock in locks] + [[-2.0, lock + 1e-12, 0.4] for lock in locks]
        )
        quaternions = Rotation.from_euler(order, angles).as_quat(scalar_first=True)
        at = EULER_ORDERS.index(order)
        found = np.asarray(all_orders(np.zeros((4, 3)), quaternions)[at][1])
        np.testing.assert_array_equal(found[:, 2], 0)
        back = Rotation.from_euler(order, found).as_matrix()
        np.testing.assert_allclose(
            back, Rotation.from_quat(quaternions, scalar_first=True).as_matrix(), rtol=0, atol=4e-12
        )
        for slopes in gradients(jnp.asarray(quaternions)).values():
            assert np.all(np.isfinite(slopes)), order


def test_gradient_is_that_of_the_inverse_map():
    """d(angles of q(angles)) is the unit matrix."""
    angles = jnp.array([0.4, 0.9, -1.3])
    for order in ("ZYX", "-xyz", "xzx"):
        there_and_back = jax.jacfwd(lambda a, o=order: quaternion_to_euler(euler_to_quaternion(a, o), o))
        np.testing.assert_allclose(there_and_back(angles), np.eye(3), rtol=0, atol=1e-13)


def test_a_minus_turns_the_signs_and_reads_the_transposed_matrix():
    a, b, c = angles = np.array([-3.14, 0.3, -2.97])
    x, y, z = (
        np.asarray(axis_angle_to_matrix(jnp.asarray(AXES[k]), t)) for k, t in zip("xyz", angles, strict=True)
    )
    found = quaternion_to_matrix(euler_to_quaternion(angles, "-xyz"))
    np.testing.assert_allclose(found, (x @ y @ z).T, rtol=0, atol=1e-15)
    np.testing.assert_allclose(
        found, Rotation.from_euler("ZYX", [-c, -b, -a]).as_matrix(), rtol=0, atol=1e-15
    )
    np.testing.assert_allclose(
        quaternion_to_euler(euler_to_quaternion(angles, "-xyz"), "-xyz"), angles, rtol=0, atol=1e-14
    )


def test_angles_printed_in_paper_004_are_those_of_the_tool_at_its_start(oracles):
    """To the two digits printed."""
    tool = oracles["wu6"].data["rollout"]["samples"][0]["end_effectors"][0]["R"]
    found = Rotation.from_quat(euler_to_quaternion(jnp.array([-3.14, 0.0, -2.97]), "-xyz"), scalar_first=True)
    assert (found.inv() * Rotation.from_matrix(tool)).magnitude() < np.sqrt(3) * 0.005


@pytest.mark.parametrize("order", ["XyZ", "XXY", "ABC", "zy", "", None, "--xyz"])
def test_unknown_orders_are_refused(order):
    for function, size in ((euler_to_quaternion, 3), (quaternion_to_euler, 4)):
        with pytest.raises(InputError, match=r"Euler order .* is unknown: three of XYZ"):
            function(jnp.ones(size) / 2, order)
