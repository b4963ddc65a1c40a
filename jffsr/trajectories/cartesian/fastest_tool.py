"""The fastest timing of a path under limits of the tool's own speed and acceleration."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.spatial.safe import safe_norm
from jffsr.trajectories.cartesian.fastest import fastest_timing, rate_bound
from jffsr.trajectories.cartesian.interface import ToolPath
from jffsr.trajectories.cartesian.poses import checked_positive
from jffsr.trajectories.cartesian.tabulated import Tabulated
from jffsr.trajectories.cartesian.tool_trajectory import as_node, path_derivatives
from jffsr.trajectories.checks import checked_size
from jffsr.types import Array, Vector

_FACETS = 32  # of the polygon that stands for the disc of accelerations


def fastest_tool_timing(
    path: ToolPath,
    speed: float,
    angular_speed: float,
    acceleration: float,
    angular_acceleration: float,
    steps: int = 200,
) -> Tabulated:
    """The fastest timing from rest to rest under limits of the tool's own motion: m/s, rad/s, m/s^2 and rad/s^2.

    The discs of linear and of angular acceleration are replaced by polygons of 32 corners inside them, which touch
    them along the path and across it and lose at most 0.5 % elsewhere. Raises InputError for limits that are not
    positive or fewer than two steps of the grid.
    """
    limits = [
        checked_positive(value, what, unit)
        for value, what, unit in (
            (speed, "speed", "m/s"),
            (angular_speed, "angular_speed", "rad/s"),
            (acceleration, "acceleration", "m/s^2"),
            (angular_acceleration, "angular_acceleration", "rad/s^2"),
        )
    ]
    places = jnp.linspace(0.0, 1.0, checked_size(steps, 2, "steps") + 1)
    return _fastest_tool_timing(as_node(path, 1.0), places, *limits)


@jax.jit
def _fastest_tool_timing(
    path: ToolPath, places: Vector, speed: Array, spin: Array, linear: Array, angular: Array
) -> Tabulated:
    _, slope, bend = jax.vmap(lambda s: path_derivatives(path, s))(places)
    lengths, rows = [], []
    for part, limit in ((slice(0, 3), linear), (slice(3, 6), angular)):
        length, facets = _facets(slope[:, part], bend[:, part])
        lengths.append(length)
        rows.append([x / (limit * np.cos(np.pi / _FACETS)) for x in facets])
    slopes, bends = (jnp.concatenate(x, axis=1) for x in zip(*rows, strict=True))
    most = rate_bound(jnp.stack(lengths, axis=1), jnp.stack([jnp.asarray(speed), jnp.asarray(spin)]))
    return fastest_timing(places, most, slopes, bends, jnp.ones(slopes.shape[1]))


def _facets(slope: Array, bend: Array) -> tuple[Vector, tuple[Array, Array]]:
    """Length (k,) of the slopes (k, 3), and along the normals of half the facets what u and x accelerate (k, 16)."""
    length = safe_norm(slope)
    along = slope / jnp.where(length > 0, length, 1.0)[:, None]
    tangential = jnp.sum(bend * along, axis=1)
    normal = safe_norm(bend - tangential[:, None] * along)
    angles = np.pi * (2 * np.arange(_FACETS // 2) + 1) / _FACETS
    cosine, sine = np.cos(angles), np.sin(angles)
    return length, (length[:, None] * cosine, tangential[:, None] * cosine + normal[:, None] * sine)
