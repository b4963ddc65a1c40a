"""The grasp-time criterion of Wang, Luo and Yu (2021), eq. (15), over a predicted motion, and its local minima."""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.capture.capability_map import CapabilityMap
from jffsr.compiling import program
from jffsr.robots.state import State
from jffsr.spatial.rotation import quaternion_to_matrix
from jffsr.spatial.safe import safe_norm
from jffsr.target.grasp_frames import fixed_frame
from jffsr.target.tumbling import TargetMotion
from jffsr.types import Array, Scalar, Vector3

_SECTIONS = 60
_SHARE = (np.sqrt(5) - 1) / 2
_BRACKETS = 8  # polished in one call; a multiple, so that few shapes are compiled


@dataclass(frozen=True)
class GraspScan:
    """The criterion of one grasp frame at N times, on the host.

    time (N,), s; value (N,), m; distance (N,), m, from the tool's start to the grasp point; facing (N,), the cosine
    between the way there and the approach axis; share (N,), the map's value; near and feasible (N,), whether the map
    holds the point, and whether the approach axis also points away from the tool; windows (k, 2), s, first and last
    feasible time of each stretch.
    """

    grasp: str
    time: np.ndarray
    value: np.ndarray
    distance: np.ndarray
    facing: np.ndarray
    share: np.ndarray
    near: np.ndarray
    feasible: np.ndarray
    windows: np.ndarray


@dataclass(frozen=True)
class GraspCandidate:
    """A local minimum of the criterion: grasp frame, time, s, value, m, the map's share there; at_edge says that it is
    where a window begins or ends rather than between."""

    grasp: str
    time: float
    value: float
    share: float
    at_edge: bool


def criterion(rho: Vector3, approach: Vector3, share: Scalar) -> Scalar:
    """(2 |rho| - n_x' rho)/(1 + D), m: near, facing away from the tool and well within the arm's workspace is least."""
    return (2 * safe_norm(rho) - approach @ rho) / (1 + share)


def _at(motion, frame, tool, state, capability, time) -> tuple[Array, ...]:
    position, quaternion, _ = fixed_frame(motion(time), *frame)
    rho, approach = position - tool, quaternion_to_matrix(quaternion)[:, 0]
    share = jnp.zeros(())
    if capability is not None:
        base = quaternion_to_matrix(state.base_quaternion)
        share = capability.value(base.T @ (position - state.base_position))
    distance = safe_norm(rho)
    along = approach @ rho
    return criterion(rho, approach, share), distance, along / jnp.maximum(distance, 1e-12), share


@program(once=True)
def _over(motion, frame, tool, state, capability, time):
    return jax.vmap(lambda t: _at(motion, frame, tool, state, capability, t))(time)


@program(once=True)
def _golden(motion, frame, tool, state, capability, least_share, left, right):
    """Times (k,) of the least feasible value in brackets by golden sections, which kinks of the map do not disturb."""

    def value(time):
        found, _, facing, share = _at(motion, frame, tool, state, capability, time)
        near = True if capability is None else share > least_share
        return jnp.where(near & (facing > 0), found, jnp.inf)

    def section(_, ends):
        a, b = ends
        inner_a, inner_b = b - _SHARE * (b - a), a + _SHARE * (b - a)
        # Where neither is feasible, the feasible middle of the bracket is between them.
        low, high = jax.vmap(value)(inner_a), jax.vmap(value)(inner_b)
        both = jnp.isinf(low) & jnp.isinf(high)
        keep_left = low <= high
        return (
            jnp.where(both, inner_a, jnp.where(keep_left, a, inner_a)),
            jnp.where(both, inner_b, jnp.where(keep_left, inner_b, b)),
        )

    a, b = jax.lax.fori_loop(0, _SECTIONS, section, (left, right))
    time = 0.5 * (a + b)
    return time, jax.vmap(value)(time)


def scan_grasp(
    motion: TargetMotion,
    grasp: str,
    tool: Vector3,
    state: State,
    capability: CapabilityMap | None,
    least_share: float,
    time: np.ndarray,
) -> tuple[GraspScan, tuple[GraspCandidate, ...]]:
    """The criterion of a grasp frame at times (N,), s, and its local minima, polished between the samples."""
    index = motion.target.grasp_index(grasp)
    frame = tuple(
        jnp.asarray(x)[index] for x in (motion.target.grasp_position, motion.target.grasp_quaternion)
    )
    if capability is not None:
        # The lookup needs the shares alone.
        capability = replace(capability, direction_share=np.zeros(0))
    given = (motion, frame, tool, state, capability)
    value, distance, facing, share = map(np.asarray, _over(*given, jnp.asarray(time)))
    near = np.ones(len(time), dtype=bool) if capability is None else share > least_share
    feasible = near & (facing > 0)
    scan = GraspScan(grasp, time, value, distance, facing, share, near, feasible, _stretches(time, feasible))
    padded = np.concatenate([[np.inf], np.where(feasible, value, np.inf), [np.inf]])
    # Of equal neighbours the first counts.
    places = np.flatnonzero(feasible & (padded[1:-1] < padded[:-2]) & (padded[1:-1] <= padded[2:]))
    if not len(places):
        return scan, ()
    last = len(time) - 1
    edge = np.isinf(padded[places]) | np.isinf(padded[places + 2]) | (places == 0) | (places == last)
    padding = -len(places) % _BRACKETS
    wide = np.concatenate([places, np.repeat(places[-1], padding)])
    left, right = time[np.maximum(wide - 1, 0)], time[np.minimum(wide + 1, last)]
    polished, least = map(np.asarray, _golden(*given, least_share, jnp.asarray(left), jnp.asarray(right)))
    # At an edge the sections end beside it; unless they found what is better, the sample stands.
    better = least < value[wide] - 1e-12
    polished = np.where(better, polished, time[wide])[: len(places)]
    found, _, _, there = map(np.asarray, _over(*given, jnp.asarray(np.pad(polished, (0, padding), "edge"))))
    return scan, tuple(
        GraspCandidate(grasp, float(t), float(v), float(s), bool(e))
        for t, v, s, e in zip(polished, found, there, edge, strict=False)
    )


def _stretches(time: np.ndarray, feasible: np.ndarray) -> np.ndarray:
    """First and last time (k, 2) of each stretch of feasible samples."""
    change = np.diff(np.concatenate([[0], feasible.astype(int), [0]]))
    return np.stack([time[change[:-1] == 1], time[change[1:] == -1]], axis=1)
