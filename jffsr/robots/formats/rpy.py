"""Roll, pitch and yaw in radians, as URDF has them, to a rotation matrix and back, exact to rounding."""

from __future__ import annotations

import math

import numpy as np

_QUARTER = math.pi / 2


def rpy_to_matrix(rpy: tuple[float, float, float]) -> np.ndarray:
    """R = Rz(yaw) Ry(pitch) Rx(roll), exact where an angle is a multiple of 90 degrees to rounding."""
    (cr, sr), (cp, sp), (cy, sy) = (_cosine_and_sine(angle) for angle in rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def matrix_to_rpy(rotation: np.ndarray) -> tuple[float, float, float]:
    """Angles whose matrix is `rotation` to rounding, at every rotation.

    Near a pitch of 90 degrees yaw alone is ill-conditioned; roll is therefore measured after the yaw that
    was found is taken out, so that the two make up for each other.
    """
    r = np.asarray(rotation, dtype=float)
    yaw = math.atan2(r[1, 0], r[0, 0])
    c, s = math.cos(yaw), math.sin(yaw)
    pitch = math.atan2(-r[2, 0], c * r[0, 0] + s * r[1, 0])
    roll = math.atan2(s * r[0, 2] - c * r[1, 2], c * r[1, 1] - s * r[0, 1])
    return roll, pitch, yaw


def matrix_to_quaternion(rotation: np.ndarray) -> np.ndarray:
    """Unit quaternion (w, x, y, z) of a rotation matrix, in NumPy; the row of 4 q q' that is longest."""
    r = np.asarray(rotation, dtype=float)
    trace = np.trace(r)
    outer = np.array(
        [
            [1 + trace, r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
            [0, 1 + 2 * r[0, 0] - trace, r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
            [0, 0, 1 + 2 * r[1, 1] - trace, r[1, 2] + r[2, 1]],
            [0, 0, 0, 1 + 2 * r[2, 2] - trace],
        ]
    )
    outer = outer + np.triu(outer, 1).T
    row = outer[np.argmax(np.diagonal(outer))]
    return row / np.linalg.norm(row) * (1.0 if row[0] >= 0 else -1.0)


def quaternion_to_matrix(quaternion: np.ndarray) -> np.ndarray:
    """Rotation matrix of a quaternion (w, x, y, z) of any length but zero, in NumPy."""
    w, x, y, z = np.asarray(quaternion, dtype=float) / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _cosine_and_sine(angle: float) -> tuple[float, float]:
    # pi/2 has no exact number: its cosine, 6e-17, would tilt axes that a file states as parallel.
    quarters = round(angle / _QUARTER)
    if abs(quarters) < 100 and abs(angle - quarters * _QUARTER) <= 4e-16 * max(1.0, abs(angle)):
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[quarters % 4]
    return math.cos(angle), math.sin(angle)
