"""A camera's noise is what it says, its dropouts and outliers too, and its frame can be undone."""

from __future__ import annotations

import jax
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jffsr.errors import InputError
from jffsr.target.body import Target
from jffsr.target.camera import Camera, observe_target
from jffsr.target.target_state import TargetState

HALF = np.sqrt(0.5)
MARKER = (np.array([0.3, -0.2, 0.1]), np.array([HALF, HALF, 0.0, 0.0]))
COUNT = 20000


def still(count):
    body = np.array([0.5, 0.5, -0.5, 0.5])
    states = TargetState(
        np.tile([2.0, 1.0, -0.5], (count, 1)),
        np.zeros((count, 3)),
        np.tile(body, (count, 1)),
        np.zeros((count, 3)),
    )
    rotation = Rotation.from_quat(body, scalar_first=True)
    marker = rotation * Rotation.from_quat(MARKER[1], scalar_first=True)
    return states, np.array([2.0, 1.0, -0.5]) + rotation.apply(MARKER[0]), marker


@pytest.mark.parametrize("factor", [1.0, 3.0])
def test_standard_noise_is_what_it_says(factor):
    camera = Camera().scaled(factor)
    states, position, marker = still(COUNT)
    seen = observe_target(Target.create((3, 2, 2), marker=MARKER), states, camera, jax.random.key(0))
    away = np.asarray(seen.position) - position
    turn = (marker.inv() * Rotation.from_quat(seen.quaternion, scalar_first=True)).as_rotvec()
    # The median of absolute values does not see 2 % of outliers by more than 3 %; its own error is 1 %.
    for error, deviation in ((away, 0.01 * factor), (turn, np.deg2rad(2) * factor)):
        np.testing.assert_allclose(np.median(np.abs(error), axis=0) / 0.67449, deviation, rtol=0.05)
    # Beyond 4.5 deviations are 65 % of ten times as wide a normal law, and next to nothing of the other one.
    far = np.mean(np.abs(away) > 4.5 * 0.01 * factor)
    np.testing.assert_allclose(far, 0.02 * 0.6527, rtol=0.12)
    np.testing.assert_allclose(np.mean(np.asarray(seen.seen)), 0.95, atol=0.006)
    np.testing.assert_allclose(np.diff(seen.time), 0.1)
    np.testing.assert_allclose(
        np.sqrt(np.diag(camera.covariance))[[0, 5]], [0.01 * factor, np.deg2rad(2) * factor]
    )


def test_the_key_decides_and_the_cameras_frame_is_undone():
    states, position, marker = still(50)
    target = Target.create((3, 2, 2), marker=MARKER)
    camera = Camera(position_deviation=1e-9, attitude_deviation=1e-9, outliers=0.0)
    rng = np.random.default_rng(2)
    base = rng.standard_normal((50, 3)), Rotation.random(50, random_state=3).as_quat(scalar_first=True)
    first, again, other = (
        observe_target(target, states, camera, jax.random.key(k), *base) for k in (0, 0, 1)
    )
    assert np.array_equal(first.position, again.position)
    assert not np.array_equal(first.seen, other.seen)
    # In the camera's frame it is the marker seen from there.
    expected = Rotation.from_quat(base[1], scalar_first=True).inv().apply(position - base[0])
    np.testing.assert_allclose(first.position, expected, atol=1e-7)
    inertial = first.in_inertial(*base)
    np.testing.assert_allclose(inertial.position, np.tile(position, (50, 1)), atol=1e-7)
    apart = marker.inv() * Rotation.from_quat(inertial.quaternion, scalar_first=True)
    assert apart.magnitude().max() < 1e-7


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"rate": 0.0}, "rate is 0"),
        ({"attitude_deviation": float("nan")}, "attitude_deviation is nan"),
        ({"delay": -0.1}, "delay is -0.1 s"),
        ({"dropouts": 1.0}, "dropouts is 1; a share"),
        ({"outliers": -0.2}, "outliers is -0.2"),
    ],
)
def test_numbers_that_make_no_sense_are_refused(wrong, says):
    with pytest.raises(InputError, match=says):
        Camera(**wrong)
