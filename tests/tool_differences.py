"""Twists and accelerations of a tool's poses by differences of order eight, which share no formula with the package."""

from __future__ import annotations

import jax
import numpy as np
from scipy.spatial.transform import Rotation

_WEIGHTS = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])


_SIZE = 512  # times of any number are padded to a multiple, so that few programs are compiled


def sample(trajectory, times):
    """What a trajectory asks for at times (N,)."""
    count = np.size(times)
    padded = np.concatenate([times, np.full(-count % _SIZE, np.asarray(times)[-1])])
    return jax.tree.map(lambda x: np.asarray(x)[:count], _sampled(trajectory, padded))


@jax.jit
def _sampled(trajectory, times):
    return jax.vmap(trajectory)(times)


def differenced_twists(trajectory, times, step=0.02):
    """Twists from differenced poses and accelerations from differenced twists, (N, 6) each."""
    grid = times[:, None] + step * np.arange(-4, 5)
    found = sample(trajectory, grid.ravel())
    positions = np.asarray(found.position).reshape(*grid.shape, 3)
    turned = Rotation.from_quat(np.asarray(found.quaternion), scalar_first=True).as_matrix()
    turned = turned.reshape(*grid.shape, 3, 3)
    velocity = np.einsum("k,nki->ni", _WEIGHTS, positions) / step
    # dR/dt R' is the cross-product matrix of the angular velocity.
    change = np.einsum("k,nkij,nlj->nil", _WEIGHTS, turned, turned[:, 4]) / step
    omega = np.stack([change[:, 2, 1], change[:, 0, 2], change[:, 1, 0]], axis=1)
    twists = np.asarray(found.twist).reshape(*grid.shape, 6)
    return np.concatenate([velocity, omega], axis=1), np.einsum("k,nki->ni", _WEIGHTS, twists) / step
