"""How well a motion keeps its momentum, judged from the poses of its bodies alone.

The rollouts obtain velocities from the momentum equation, so evaluating that equation again with those
velocities proves nothing. Here the velocities are differences of poses in time.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jffsr.dynamics.base_mode import base_freedom
from jffsr.dynamics.kinematics import kinematics, system_com
from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.motion import Motion
from jffsr.types import Array, Scalar

# Central difference of order 8: weights of x(t + k h) - x(t - k h) for k = 1 to 4, to be divided by h.
_WEIGHTS = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
_REACH = len(_WEIGHTS)


def momentum_from_poses(robot: Robot, motion: Motion) -> Array:
    """Momentum (N - 7, 6) of a motion of N + 1 samples, from the poses of its bodies, masses and inertias.

    Rows are P, N s, then L about the system centre of mass, N m s, in I, at all samples but the first and
    last four, which central differences of order 8 cannot reach. Neither the motion's base twist nor its
    joint rates are read. Raises InputError for fewer than 9 samples.
    """
    linear, angular, _ = _body_momenta(robot, motion)
    return jnp.concatenate([jnp.sum(linear, axis=1), jnp.sum(angular, axis=1)], axis=-1)


def momentum_drift(robot: Robot, motion: Motion) -> Scalar:
    """Largest relative deviation of `momentum_from_poses` from the momentum that the motion states.

    The larger of the linear and the angular deviation, each divided by the largest sum over the bodies of
    the norms of their own momenta (angular: about the system centre of mass), which is not zero where the
    total is. A motion slower than differences of its poses can resolve is compared with that resolution,
    so that a robot at rest gives 0. What the motion's base_mode does not conserve is not judged: with the
    attitude held the linear deviation alone, on a fixed base nothing, which gives 0. Raises InputError for
    fewer than 9 samples.
    """
    linear, angular, resolution = _body_momenta(robot, motion)
    stated, freedom = motion.momentum, base_freedom(motion.base_mode)
    if freedom == 0:
        return jnp.zeros(())
    drift = _deviation(linear, stated[:3], resolution[0])
    return drift if freedom == 3 else jnp.maximum(drift, _deviation(angular, stated[3:], resolution[1]))


def _deviation(parts: Array, stated: Array, resolution: Scalar) -> Scalar:
    """Largest |sum of the parts (K, b, 3) - stated (3,)| over the largest sum of their norms."""
    error = jnp.max(jnp.linalg.norm(jnp.sum(parts, axis=1) - stated, axis=-1))
    size = jnp.max(jnp.sum(jnp.linalg.norm(parts, axis=-1), axis=1))
    return error / jnp.maximum(jnp.maximum(size, jnp.linalg.norm(stated)), resolution)


def _body_momenta(robot: Robot, motion: Motion) -> tuple[Array, Array, tuple[Scalar, Scalar]]:
    """Linear and angular momentum (K, b, 3) of every body, and the sizes that differences resolve."""
    samples = motion.time.shape[0]
    if samples < 2 * _REACH + 1:
        raise InputError(
            f"the motion has {samples} samples; momentum from poses needs at least {2 * _REACH + 1}"
        )

    def poses(position: Array, quaternion: Array, joints: Array) -> tuple[Array, Array, Array, Array]:
        kin = kinematics(robot, State(position, quaternion, joints))
        return kin.com, kin.rotation, kin.inertia_I, system_com(robot, kin)

    com, rotation, inertia, centre = jax.vmap(poses)(
        motion.base_position, motion.base_quaternion, motion.joint_position
    )
    mass = jnp.asarray(robot.mass)
    step = motion.time[1] - motion.time[0]
    inner = slice(_REACH, samples - _REACH)
    turning = _difference(rotation, step) @ jnp.swapaxes(rotation[inner], -1, -2)
    rate = 0.5 * jnp.stack(
        [
            turning[..., 2, 1] - turning[..., 1, 2],
            turning[..., 0, 2] - turning[..., 2, 0],
            turning[..., 1, 0] - turning[..., 0, 1],
        ],
        axis=-1,
    )
    linear = mass[:, None] * _difference(com, step)
    lever = com[inner] - centre[inner, None]
    angular = jnp.einsum("kbij,kbj->kbi", inertia[inner], rate) + jnp.cross(lever, linear)

    # What a rounding of the poses looks like as momentum, times the factor that leaves half of the digits.
    blur = jnp.sqrt(jnp.finfo(com.dtype).eps) / step
    linear_blur = mass * jnp.max(jnp.linalg.norm(com, axis=-1), axis=0) * blur
    spin_blur = jnp.trace(inertia[0], axis1=-2, axis2=-1) * blur
    arm = jnp.max(jnp.linalg.norm(lever, axis=-1), axis=0)
    return linear, angular, (jnp.sum(linear_blur), jnp.sum(arm * linear_blur + spin_blur))


def _difference(x: Array, step: Scalar) -> Array:
    """Time derivative of samples x (N + 1, ...) at the N - 7 inner ones."""
    last = x.shape[0] - _REACH
    # Pairs are subtracted first: a constant then gives exactly zero.
    return (
        sum(
            weight * (x[_REACH + k : last + k] - x[_REACH - k : last - k])
            for k, weight in enumerate(_WEIGHTS, start=1)
        )
        / step
    )
