"""Where a target is and how it moves at one instant."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.robots.lumping import array_module, on_host, to_array
from jffsr.types import Array, Quaternion

# Printed quaternions are rounded; farther from unit length they are told of, still farther refused.
_ROUNDED, _MISTAKEN = 1e-3, 5e-2


@register_dataclass
@dataclass(frozen=True, eq=False)
class TargetState:
    """Pose and velocity of a target's frame T, whose origin is the centre of mass; leading batch axes are allowed.

    position (..., 3), m, and velocity (..., 3), m/s, in I; quaternion (..., 4), T to I; angular_velocity_T (..., 3),
    rad/s, resolved in T.
    """

    position: Array
    velocity: Array
    quaternion: Array
    angular_velocity_T: Array

    @classmethod
    def create(
        cls, position: Array, velocity: Array, quaternion: Array, angular_velocity_T: Array
    ) -> TargetState:
        """The checked state: the quaternion is made unit, with a warning where it is off by more than rounding.

        Raises InputError for wrong shapes and for numbers that are not finite; traced numbers pass.
        """
        vectors = {"position": position, "velocity": velocity, "angular_velocity_T": angular_velocity_T}
        vectors = {what: to_array(value) for what, value in vectors.items()}
        quaternion = to_array(quaternion)
        for what, value in {**vectors, "quaternion": quaternion}.items():
            last = 4 if what == "quaternion" else 3
            if value.shape[-1:] != (last,):
                raise InputError(f"target state: {what} has shape {value.shape}, (..., {last}) is expected")
            numbers = on_host(value)
            if numbers is not None and not np.all(np.isfinite(numbers[0])):
                raise InputError(f"target state: {what} {numbers[0].tolist()} is not finite")
        return cls(quaternion=unit_quaternion("target state", quaternion), **vectors)


def unit_quaternion(where: str, quaternion: Quaternion) -> Quaternion:
    """The quaternion (..., 4) at unit length; InputError beyond 5 % of it, a warning beyond 0.1 %."""
    xp = array_module(quaternion)
    length = xp.sqrt(xp.sum(quaternion * quaternion, axis=-1, keepdims=True))
    numbers = on_host(length)
    if numbers is not None:
        off = np.max(np.abs(numbers[0] - 1))
        if not off <= _MISTAKEN:
            raise InputError(
                f"{where}: quaternion {np.asarray(quaternion).tolist()} is off unit length by {off:.3g}; "
                "(w, x, y, z) of length 1 is expected"
            )
        if off > _ROUNDED:
            warnings.warn(f"{where}: a quaternion off unit length by {off:.3g} was normalised", stacklevel=3)
    return quaternion / length
