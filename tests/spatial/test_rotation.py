"""Quaternions, rotation vectors, matrices, Euler angles: group laws, inverses, gradients at hard places."""

from __future__ import annotations

from functools import partial

import chex
import jax
import numpy as np
import pytest

from jffsr.spatial.rotation import (
    axis_angle_to_matrix,
    frame_along,
    matrix_to_quaternion,
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_euler_zxy,
    quaternion_to_matrix,
    quaternion_to_rotation_vector,
    rotation_vector_to_quaternion,
)

near = partial(np.testing.assert_allclose, rtol=0, atol=1e-14)
exp = jax.jit(rotation_vector_to_quaternion)
log = jax.jit(quaternion_to_rotation_vector)
IDENTITY = np.array([1.0, 0, 0, 0])


@pytest.fixture(scope="module")
def quaternions():
    q = np.random.default_rng(0).normal(size=(3, 20, 4))
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def _finite_difference(f, x, step=1e-6):
    columns = [(f(x + step * e) - f(x - step * e)) / (2 * step) for e in np.eye(len(x))]
    return np.stack([np.asarray(c) for c in columns], axis=-1)


def test_group_laws(quaternions):
    a, b, c = quaternions
    multiply = quaternion_multiply
    near(multiply(multiply(a, b), c), multiply(a, multiply(b, c)))
    near(multiply(a, IDENTITY), a)
    near(multiply(IDENTITY, a), a)
    near(multiply(a, quaternion_conjugate(a)), np.tile(IDENTITY, (20, 1)))
    near(np.linalg.norm(multiply(a, b), axis=-1), 1)


def test_matrices_are_a_representation(quaternions):
    a, b, _ = quaternions
    matrix = quaternion_to_matrix(a)
    chex.assert_shape(matrix, (20, 3, 3))
    near(quaternion_to_matrix(quaternion_multiply(a, b)), matrix @ quaternion_to_matrix(b))
    near(quaternion_to_matrix(quaternion_conjugate(a)), np.swapaxes(matrix, -1, -2))
    near(matrix @ np.swapaxes(matrix, -1, -2), np.tile(np.eye(3), (20, 1, 1)))
    near(np.linalg.det(matrix), 1)


def test_convention():
    """A quarter turn about z takes x to y: Hamilton, body to parent, scalar first."""
    quarter = np.array([np.sqrt(0.5), 0, 0, np.sqrt(0.5)])
    near(quaternion_to_matrix(quarter) @ np.array([1.0, 0, 0]), [0, 1, 0])
    i, j, k = np.eye(4)[1:]
    near(quaternion_multiply(i, j), k)
    near(rotation_vector_to_quaternion(np.array([0, 0, np.pi / 2])), quarter)


@pytest.mark.parametrize(
    "angle", [0.0, 1e-300, 1e-16, 1e-9, 0.99e-5, 1.01e-5, 1e-3, 1.0, 3.0, np.pi - 1e-3, np.pi - 1e-9]
)
def test_exp_and_log_are_inverse(angle):
    axis = np.array([2.0, -1.0, 2.0]) / 3
    q = exp(angle * axis)
    near(np.linalg.norm(q), 1)
    # Where cos or sin themselves carry the rounding of the angle, relative accuracy is that of the angle.
    np.testing.assert_allclose(log(q), angle * axis, rtol=2e-15, atol=0 if angle < 1e-3 else 1e-15)
    near(exp(log(q)), q)
    near(log(-q), log(q))


def test_exp_is_rodrigues():
    axis = np.array([2.0, -1.0, 2.0]) / 3
    for angle in (-2.0, 0.0, 1e-6, 0.7, np.pi):
        near(quaternion_to_matrix(exp(angle * axis)), axis_angle_to_matrix(axis, angle))


def test_half_a_turn_has_length_pi():
    for axis in (*np.eye(3), np.array([2.0, -1.0, 2.0]) / 3):
        q = np.concatenate([[0.0], axis])
        near(log(q), np.pi * axis)
        near(np.linalg.norm(log(-q)), np.pi)


@pytest.mark.parametrize("angle", [0.0, 1e-200, 1e-12, 0.99e-5, 1.01e-5, np.pi - 1e-12, np.pi])
def test_gradients_stay_finite(angle):
    axis = np.array([0.6, 0.0, 0.8])
    for f, x in ((exp, angle * axis), (log, np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * axis]))):
        chex.assert_tree_all_finite((jax.jacfwd(f)(x), jax.jacrev(f)(x)))
    q = np.array([0.0, *axis])
    chex.assert_tree_all_finite((jax.jacfwd(log)(q), jax.jacrev(log)(-q)))


def test_gradients_at_identity_are_the_textbook_ones():
    near(jax.jacrev(exp)(np.zeros(3)), np.vstack([np.zeros(3), 0.5 * np.eye(3)]))
    near(jax.jacrev(log)(IDENTITY)[:, 1:], 2 * np.eye(3))


@pytest.mark.parametrize("angle", [1e-7, 0.99e-5, 1.01e-5, 1e-2, 0.5, 2.0, 3.1])
def test_gradients_are_finite_differences(angle):
    axis = np.array([2.0, -1.0, 2.0]) / 3
    vector = angle * axis
    np.testing.assert_allclose(jax.jacrev(exp)(vector), _finite_difference(exp, vector), rtol=0, atol=1e-9)

    def through(v):
        return log(quaternion_multiply(exp(v), exp(np.array([0.2, 0.1, -0.3]))))

    np.testing.assert_allclose(
        jax.jacrev(through)(vector), _finite_difference(through, vector), rtol=1e-7, atol=1e-7
    )
    near(jax.jacrev(lambda v: log(exp(v)))(vector), np.eye(3), atol=1e-9)


BRANCHES = {
    "w": np.array([0.9, 0.3, -0.2, 0.2]),
    "x": np.array([0.1, 0.9, 0.3, -0.2]),
    "y": np.array([0.2, -0.1, 0.9, 0.3]),
    "z": np.array([0.1, 0.2, -0.3, 0.9]),
    "half a turn": np.array([0.0, 0.6, 0.0, 0.8]),
    "identity": np.array([1.0, 0, 0, 0]),
    "tie": np.array([0.5, 0.5, -0.5, 0.5]),
}


@pytest.mark.parametrize("branch", BRANCHES)
def test_matrix_to_quaternion_on_every_branch(branch):
    q = BRANCHES[branch] / np.linalg.norm(BRANCHES[branch])
    convert = jax.jit(matrix_to_quaternion)
    near(convert(quaternion_to_matrix(q)), q)
    near(convert(quaternion_to_matrix(-q)), q)
    chex.assert_tree_all_finite(jax.jacrev(matrix_to_quaternion)(np.array(quaternion_to_matrix(q))))

    def turned(v):
        return matrix_to_quaternion(quaternion_to_matrix(quaternion_multiply(exp(v), q)))

    # d(exp(v) q)/dv at zero is half of the product of the imaginary units with q.
    expected = np.stack([0.5 * np.asarray(quaternion_multiply(unit, q)) for unit in np.eye(4)[1:]], axis=-1)
    np.testing.assert_allclose(jax.jacrev(turned)(np.zeros(3)), expected, rtol=0, atol=1e-12)


def _from_zxy(angles):
    about_z, about_x, about_y = angles
    ex, ey, ez = np.eye(3)
    return (
        axis_angle_to_matrix(ez, about_z)
        @ axis_angle_to_matrix(ex, about_x)
        @ axis_angle_to_matrix(ey, about_y)
    )


@pytest.mark.parametrize(
    "angles", [(0.0, 0.0, 0.0), (0.3, -0.4, 0.5), (3.0, 1.5, -3.0), (-2.5, -1.5, 2.9), (1e-9, 1e-9, -1e-9)]
)
def test_euler_zxy_round_trip(angles):
    matrix = _from_zxy(angles)
    found = quaternion_to_euler_zxy(matrix_to_quaternion(matrix))
    np.testing.assert_allclose(found, angles, rtol=0, atol=1e-13)
    chex.assert_tree_all_finite(jax.jacrev(quaternion_to_euler_zxy)(matrix_to_quaternion(matrix)))


@pytest.mark.parametrize("sign", [-1, 1])
def test_euler_zxy_at_its_singularity(sign):
    """Two of the angles are not unique there; the rotation they describe is, and gradients are finite."""
    q = np.array([np.sqrt(0.5), sign * np.sqrt(0.5), 0, 0])
    angles = quaternion_to_euler_zxy(q)
    np.testing.assert_allclose(angles[1], sign * np.pi / 2, rtol=0, atol=1e-7)
    np.testing.assert_allclose(_from_zxy(angles), quaternion_to_matrix(q), rtol=0, atol=1e-7)
    chex.assert_tree_all_finite(jax.jacrev(quaternion_to_euler_zxy)(q))


def test_a_frame_along_an_axis_is_a_rotation_with_that_axis():
    rng = np.random.default_rng(5)
    axes = np.concatenate(
        [rng.normal(size=(200, 3)), np.eye(3), -np.eye(3), [[1e-9, 0, -1.0], [0, 1e-9, 1.0]]]
    )
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    frames = np.asarray(frame_along(axes))
    np.testing.assert_allclose(frames[..., 2], axes, rtol=0, atol=1e-15)
    np.testing.assert_allclose(
        frames @ np.swapaxes(frames, 1, 2), np.tile(np.eye(3), (len(axes), 1, 1)), atol=1e-14
    )
    np.testing.assert_allclose(np.linalg.det(frames), 1, rtol=1e-13)
