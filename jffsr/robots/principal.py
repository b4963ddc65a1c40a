"""An inertia by its principal moments and axes, as MuJoCo wants it."""

from __future__ import annotations

import numpy as np


def principal_axes(inertia: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Principal moments (3,), kg m^2, and axes (3, 3), the columns of a rotation, of an inertia (3, 3).

    A diagonal inertia is taken as it stands. Found here, because MuJoCo's own diagonalisation stops at about
    1e-12.
    """
    inertia = np.asarray(inertia, dtype=float)
    if np.array_equal(inertia, np.diag(np.diagonal(inertia))):
        moments, axes = np.diagonal(inertia).copy(), np.eye(3)
    else:
        moments, axes = np.linalg.eigh(inertia)
        if np.linalg.det(axes) < 0:
            axes[:, 0] = -axes[:, 0]
    # The robot's checks forgive rounding in the triangle inequality; MuJoCo's do not.
    largest = int(np.argmax(moments))
    moments[largest] = min(moments[largest], np.delete(moments, largest).sum())
    return moments, axes
