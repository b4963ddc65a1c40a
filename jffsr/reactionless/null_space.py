"""Joint rates that keep the base's attitude: what absorbs the momentum, and the reaction null space around it.

About the system's centre of mass, with the base's linear velocity eliminated, the angular momentum is

    L = H_w w_0 + H_wphi qd

(Ye, Dong and Hong 2019, eq. 17 as corrected; Nenchev, Umetani and Yoshida 1992). The base stands still where
H_wphi qd = L: qd = H_wphi# L + (1 - H_wphi# H_wphi) zeta for any zeta. For chosen axes of the base only those rows of
H_w^-1 H_wphi and H_w^-1 L count, in B, and the others may turn.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import jax
import jax.numpy as jnp

from jffsr.dynamics.kinematics import Kinematics, jacobians, system_com
from jffsr.dynamics.momentum import base_twist, inertia_blocks
from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.spatial.inertia import skew
from jffsr.spatial.safe import safe_norm
from jffsr.tracking.damping import constant, raised_cosine
from jffsr.tracking.inverses import filtered_inverse, inverse_and_values
from jffsr.types import Array, Matrix, Matrix3, Scalar, Twist, Vector, Vector3

RANK_CUT = 1e-10
"""Singular values of the coupling below this share of the largest are no way to move the base."""

ALL_AXES = (0, 1, 2)

# Base rate that counts as still: a share of the one with the joints locked, and rad/s.
_STILL_SHARE, _STILL_RATE = 1e-9, 1e-12
# The tool's directions that move less than this share of the most are damped.
_TOOL_SHARE = 0.01
# Keeps that share's width off zero.
_LEAST_MOTION = 1e-12


class ReactionCode(IntEnum):
    """0 is the only success."""

    HELD = 0
    NOT_ABSORBED = 1
    NOT_FINITE = 2


SENTENCES = {
    ReactionCode.HELD: "the base stands still about the chosen axes",
    ReactionCode.NOT_ABSORBED: (
        "the joints cannot take up this momentum in this posture: the coupling matrix lacks the rank for it, "
        "and the base turns at the rate reported; ask for fewer axes, or leave the posture"
    ),
    ReactionCode.NOT_FINITE: "the rates are not finite: the state, the momentum or a wanted rate is not",
}


@register_dataclass
@dataclass(frozen=True, eq=False)
class ReactionlessRates:
    """Joint rates that hold the base's attitude, and what is left to say of them.

    joint_velocity (n,), rad/s or m/s; base_twist (6,), [linear; angular] in I, by the momentum equation; space (n,
    n), the projector on the rates that are still free; rank (), int, of the rows asked for; singular_values (k,),
    largest first; code (), int32, of `ReactionCode`, its sentence in `SENTENCES`.
    """

    joint_velocity: Vector
    base_twist: Twist
    space: Matrix
    rank: Scalar
    singular_values: Vector
    code: Scalar


def reaction_blocks(robot: Robot, kin: Kinematics) -> tuple[Matrix3, Matrix]:
    """H_w (3, 3) and H_wphi (3, n) of L = H_w w_0 + H_wphi qd, kg m^2, about the system's centre of mass, in I."""
    h_b, h_bm, _ = inertia_blocks(robot, kin)
    lever = skew(system_com(robot, kin) - kin.base_position)
    return h_b[3:, 3:] - lever @ h_b[:3, 3:], h_bm[3:] - lever @ h_bm[:3]


def absorbing(
    coupling: Matrix, wanted: Vector, cut: Scalar | float = RANK_CUT
) -> tuple[Vector, Matrix, Vector]:
    """Least-norm rates (n,) with coupling (k, n) @ rates = wanted (k,), the null space's projector (n, n), and the
    singular values (min(k, n),), largest first.

    Where there are none, those that come nearest. Singular values below `cut` of the largest count as zero.
    Derivatives are finite also at repeated singular values.
    """
    inverse, sigma = inverse_and_values(coupling, constant(0.0), cut)
    return inverse @ wanted, jnp.eye(coupling.shape[1]) - inverse @ coupling, sigma


def coupling_rank(sigma: Vector, cut: Scalar | float = RANK_CUT) -> Scalar:
    """Rank (), int32, that singular values (k,), largest first, show."""
    return jnp.sum(sigma > cut * sigma[0], dtype=jnp.int32)


def reactionless_rates(
    robot: Robot,
    kin: Kinematics,
    momentum: Twist | None = None,
    null_rate: Vector | None = None,
    axes: tuple[int, ...] = ALL_AXES,
    tool_velocity: Vector | None = None,
    end_effector: str | None = None,
) -> ReactionlessRates:
    """Rates that keep chosen axes of the base still under a momentum, and do what is asked in what freedom is left.

    momentum (6,) is P, then L about the system's centre of mass, in I, None zero; axes (static) are those of B that
    must not turn. tool_velocity, (3,) m/s or (6,) with rad/s, in I, is followed as closely as the null space allows;
    null_rate (n,) is projected on what that leaves (Ye 2019, eq. 20, for zeta). For joint limits give -gain *
    `jffsr.tracking.redundancy.limit_gradient`. Raises InputError for axes that are none.
    """
    axes = checked_axes(axes)
    momentum = jnp.zeros(6) if momentum is None else jnp.asarray(momentum)
    locked, coupling = reaction_blocks(robot, kin)
    task, wanted = attitude_task(kin.rotation[0], locked, coupling, momentum[3:], axes)
    rates, space, sigma = absorbing(task, wanted)
    if tool_velocity is not None:
        rates, space = _with_tool(
            robot, kin, momentum, rates, space, jnp.asarray(tool_velocity), end_effector
        )
    if null_rate is not None:
        rates = rates + space @ null_rate
    twist = base_twist(robot, kin, rates, momentum)
    drift = jnp.linalg.solve(locked, momentum[3:])
    turning = (kin.rotation[0].T @ twist[3:])[jnp.array(axes)]
    code = result_code(turning, drift, rates)
    return ReactionlessRates(rates, twist, space, coupling_rank(sigma), sigma, code)


def result_code(turning: Array, drift: Vector3, rates: Vector) -> Scalar:
    """Code () of rates whose base turns by `turning`, rad/s, about the axes held; drift (3,): with joints locked."""
    still = safe_norm(turning) <= _STILL_SHARE * safe_norm(drift) + _STILL_RATE
    code = jnp.where(still, ReactionCode.HELD, ReactionCode.NOT_ABSORBED)
    return jnp.where(jnp.all(jnp.isfinite(rates)), code, ReactionCode.NOT_FINITE).astype(jnp.int32)


def attitude_task(
    rotation: Matrix3, locked: Matrix3, coupling: Matrix, angular_momentum: Vector3, axes: tuple[int, ...]
) -> tuple[Matrix, Vector]:
    """Rows (k, n) and right side (k,) that keep the axes of the base (rotation (3, 3), B to I) from turning.

    With all axes they are H_wphi and L themselves, which need no inverse.
    """
    if len(axes) == 3:
        return coupling, angular_momentum
    both = jnp.concatenate([coupling, angular_momentum[:, None]], axis=1)
    rows = (rotation.T @ jnp.linalg.solve(locked, both))[jnp.array(axes)]
    return rows[:, :-1], rows[:, -1]


def checked_axes(axes: tuple[int, ...]) -> tuple[int, ...]:
    """The axes in order; InputError unless they are one, two or three of 0, 1, 2."""
    found = tuple(axes)
    if not found or len(set(found)) != len(found) or not set(found) <= set(ALL_AXES):
        raise InputError(f"axes is {found!r}; different ones of 0, 1, 2 (x, y, z of the base) are expected")
    return tuple(sorted(int(axis) for axis in found))


def _with_tool(
    robot: Robot,
    kin: Kinematics,
    momentum: Twist,
    rates: Vector,
    space: Matrix,
    velocity: Vector,
    end_effector: str | None,
) -> tuple[Vector, Matrix]:
    """Rates that move the tool within the space, and the space that this leaves."""
    if velocity.shape not in ((3,), (6,)):
        raise InputError(f"tool_velocity has shape {velocity.shape}; (3,) or (6,) is expected")
    rows = velocity.shape[0]
    j_b, j_m = jacobians(robot, kin, end_effector)

    def moved(joint_velocity: Vector) -> Vector:
        return (j_m @ joint_velocity + j_b @ base_twist(robot, kin, joint_velocity, momentum))[:rows]

    drift = moved(jnp.zeros_like(rates))
    response = jax.vmap(moved, out_axes=1)(jnp.eye(rates.shape[0])) - drift[:, None]
    inside = response @ space
    width = _TOOL_SHARE * (safe_norm(response.ravel()) + _LEAST_MOTION)
    inverse = filtered_inverse(inside, raised_cosine(width, width))
    following = space @ (inverse @ (velocity - drift - response @ rates))
    left = space @ (jnp.eye(rates.shape[0]) - filtered_inverse(inside, constant(0.0), 1e-8) @ inside)
    return rates + following, left
