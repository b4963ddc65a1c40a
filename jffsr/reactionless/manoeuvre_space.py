"""Which postures zero-reaction manoeuvres can reach: the null distribution of the coupling, and its Lie brackets.

Without momentum the base stands still where A(q) qd = 0, A being the coupling in B: rates in a distribution of the null
space's dimension. Where its brackets span all of the joint space every posture near by can be reached (Chow 1939,
Rashevskii 1938); where they close on fewer dimensions the reachable postures form a surface through the start
(Frobenius), and manoeuvres lead to its points only.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.dynamics.kinematics import kinematics
from jffsr.reactionless.null_space import RANK_CUT, reaction_blocks
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.types import Matrix, Vector

# Vectors that add less than this share of the largest to a span add nothing to its dimension.
_SPAN_CUT = 1e-7


class Reach(NamedTuple):
    """null_dimension: of the rates without reaction; bracket_rank: of them with their brackets of two and of three."""

    null_dimension: int
    bracket_rank: int


def coupling_in_base(robot: Robot, joint_position: Vector) -> Matrix:
    """H_wphi (3, n), kg m^2, in B, which the joints alone decide."""
    state = State(jnp.zeros(3), jnp.array([1.0, 0.0, 0.0, 0.0]), joint_position)
    return reaction_blocks(robot, kinematics(robot, state))[1]


def coupling_rows(robot: Robot, postures: np.ndarray) -> np.ndarray:
    """Directions (r, 3) in B in which the joints of a robot turn the base in any of some postures (p, n), on the host.

    A planar arm has one, whatever it does.
    """
    coupling = jax.jit(jax.vmap(lambda q: coupling_in_base(robot, q)))(jnp.asarray(postures))
    u, sigma, _ = np.linalg.svd(np.concatenate(np.asarray(coupling), axis=1))
    return u[:, sigma > RANK_CUT * max(sigma[0], np.finfo(float).tiny)].T


def null_projector(robot: Robot, rows: Matrix, joint_position: Vector) -> Matrix:
    """1 - A'(A A')^-1 A (n, n) of A = rows @ coupling, smooth wherever that has full rank."""
    a = rows @ coupling_in_base(robot, joint_position)
    return jnp.eye(joint_position.shape[0]) - a.T @ jnp.linalg.solve(a @ a.T, a)


def reach_of(robot: Robot, rows: np.ndarray, postures: np.ndarray) -> Reach:
    """What zero-reaction motion spans in the best of some postures (p, n), on the host.

    The best, since symmetric postures show fewer brackets than their neighbours.
    """
    n = robot.num_joints

    def fields(q: Vector) -> Matrix:
        return null_projector(robot, rows, q)

    def brackets(x, y):
        """Fields (n, a b) of all brackets [x_i, y_j] of fields (n, a) and (n, b)."""

        def found(q: Vector) -> Matrix:
            along_x = jnp.einsum("njb,bi->nij", jax.jacfwd(y)(q), x(q))
            along_y = jnp.einsum("nib,bj->nij", jax.jacfwd(x)(q), y(q))
            return (along_x - along_y).reshape(n, -1)

        return found

    twos = brackets(fields, fields)
    best = Reach(0, 0)
    # Brackets of three take long to compile, and are rarely needed.
    for depth in (lambda q: twos(q), lambda q: jnp.concatenate([twos(q), brackets(fields, twos)(q)], axis=1)):
        first, more = (
            np.asarray(x) for x in jax.jit(jax.vmap(lambda q, d=depth: (fields(q), d(q))))(postures)
        )
        for one, others in zip(first, more, strict=True):
            if np.all(np.isfinite(others)):
                found = Reach(_rank(one), _rank(np.concatenate([one, others], axis=1)))
                best = max(best, found, key=lambda reach: reach.bracket_rank)
        if best.bracket_rank == n:
            break
    return best


def _rank(vectors: np.ndarray) -> int:
    sigma = np.linalg.svd(vectors, compute_uv=False)
    # The projector's own columns are of size one; rounding alone spans nothing.
    return int(np.sum(sigma > _SPAN_CUT * max(sigma[0], 1.0)))
