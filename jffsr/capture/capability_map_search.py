"""Which poses of a block of cells an arm reaches: starts from a library of postures, then from solved neighbours.

A search of this kind may miss poses and never invents one. Each pose is tried from postures of a library, every time
the one of 32 whose tool is nearest to the pose; what is left next to a solved pose is tried from that pose's solution.
A posture with bodies in contact is no solution, and another is looked for.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.capture.capability_map_grid import PoseGrid, within_last_joint
from jffsr.capture.inverse_kinematics import descend, random_starts
from jffsr.capture.inverse_kinematics_chain import chain_to_tool, tool_pose
from jffsr.clearance.along_motion import clearances
from jffsr.clearance.model import ClearanceModel
from jffsr.compiling import program
from jffsr.parallel.devices import all_devices
from jffsr.parallel.mapping import spread
from jffsr.robots.robot import Robot
from jffsr.types import Array

LIBRARY = 16_384
CANDIDATES = 32
ITERATIONS = 15
ROUNDS = 12
NEIGHBOUR_ROUNDS = 8
TOLERANCE = 1e-4
"""m and rad; far below the size of a cell and the angle between directions."""
BATCHES = (16_384, 2_048)
"""Poses in one compiled call; what is left over is padded to the smaller."""
CHUNK, CLEARANCE_CHUNK = 512, 64


class Library(NamedTuple):
    """Random postures: joint_position (l, n), rad or m; the tool there, position (l, 3), m, and quaternion (l, 4)."""

    joint_position: Array
    position: Array
    quaternion: Array


@dataclass(frozen=True)
class Searcher:
    """The search of one arm, from postures of a library; `clearance`, m, has to exceed `margin` where it is given."""

    robot: Robot
    end_effector: str | None
    clearance: ClearanceModel | None
    margin: float
    library: Library

    @classmethod
    def create(
        cls,
        robot: Robot,
        end_effector: str | None,
        clearance: ClearanceModel | None,
        margin: float,
        seed: int,
    ) -> Searcher:
        """With a library drawn from the seed."""
        # Twice as many as are kept: most postures of most arms are clear of contact.
        count = LIBRARY if clearance is None else 2 * LIBRARY
        drawn = np.asarray(random_starts(robot, jax.random.key(seed), count))
        if clearance is not None:
            drawn = drawn[clear_postures(robot, clearance, margin, drawn)][:LIBRARY]
        return cls(
            robot, end_effector, clearance, margin, jax.device_get(_library(robot, drawn, end_effector))
        )

    def solve(self, position, quaternion, starts, places) -> tuple[np.ndarray, np.ndarray]:
        """Joint positions (k, n) for poses (k, 3), (k, 4), and whether they are reached, (k,).

        places (k,) say where in the library to look for a start; where they are negative, `starts` (k, n) are taken.
        """
        found, reached = _in_batches(
            lambda items: _improve(self.robot, self.library, items, self.end_effector),
            (position, quaternion, starts, places),
        )
        if self.clearance is not None and reached.any():
            free = clear_postures(self.robot, self.clearance, self.margin, found[reached])
            reached[np.flatnonzero(reached)[~free]] = False
        return found, reached


def clear_postures(robot: Robot, clearance: ClearanceModel, margin: float, q: np.ndarray) -> np.ndarray:
    """Which postures (k, n) keep all distances of the model above the margin, m; (k,)."""
    return _in_batches(lambda items: _clear(robot, clearance, jnp.asarray(margin), items), q)


@program(static_argnums=2)
def _library(robot, q, end_effector) -> Library:
    chain = chain_to_tool(robot, end_effector)

    def tool(joints):
        pose = tool_pose(chain, joints[chain.index])
        return Library(joints, jnp.stack(pose.position), jnp.stack(pose.quaternion))

    return jax.vmap(tool)(q)


@program(static_argnums=3)
def _improve(robot, library, items, end_effector):
    chain = chain_to_tool(robot, end_effector)

    def one(item):
        wanted, attitude, given, place = item
        # The library is random, so that a slice of it is as good as a draw.
        near = jax.tree.map(lambda x: jax.lax.dynamic_slice_in_dim(x, place, CANDIDATES), library)
        away = jnp.sum((near.position - wanted) ** 2, axis=1) / chain.length**2
        turned = 4 * (1 - (near.quaternion @ attitude) ** 2)
        best = near.joint_position[jnp.argmin(away + turned)]
        start = jnp.where(place >= 0, best, given)
        found, errors = descend(chain, tuple(wanted), tuple(attitude), start, ITERATIONS)
        return found, (errors[0] <= TOLERANCE) & (errors[1] <= TOLERANCE)

    return spread(one, items, chunk=CHUNK, together=True)


@program()
def _clear(robot, clearance, margin, q):
    still = jnp.zeros((1, 3)), jnp.array([[1.0, 0.0, 0.0, 0.0]])

    def one(joints):
        posture = SimpleNamespace(
            base_position=still[0], base_quaternion=still[1], joint_position=joints[None]
        )
        return jnp.all(clearances(clearance, robot, posture) > margin)

    return spread(one, q, chunk=CLEARANCE_CHUNK, together=True)


def _in_batches(function: Callable, batch):
    """A compiled function of host arrays in calls of two sizes alone, on all devices."""
    leaves, structure = jax.tree.flatten(batch)
    count, done, parts = len(leaves[0]), 0, []
    large, small = BATCHES
    while done < count:
        size = large if count - done > large // 2 else small
        index = np.minimum(np.arange(done, done + size), count - 1)
        part = structure.unflatten([leaf[index] for leaf in leaves])
        with all_devices():
            results = jax.device_get(function(part))
        parts.append(jax.tree.map(lambda x, left=count - done: np.asarray(x)[:left], results))
        done += size
    return jax.tree.map(lambda *x: np.concatenate(x), *parts)


def search_poses(
    searcher: Searcher, position: np.ndarray, quaternion: np.ndarray, random: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Joint positions (k, n) for poses (k, 3), (k, 4) of the tool in B, and which of them were reached, (k,)."""
    found = np.zeros((len(position), searcher.robot.num_joints))
    reached = np.zeros(len(position), dtype=bool)
    for _ in range(ROUNDS):
        left = np.flatnonzero(~reached)
        if not len(left):
            break
        places = random.integers(0, len(searcher.library.position) - CANDIDATES, len(left))
        q, met = searcher.solve(position[left], quaternion[left], found[left], places)
        found[left[met]], reached[left[met]] = q[met], True
    return found, reached


def search_block(
    searcher: Searcher, grid: PoseGrid, quaternion: np.ndarray, cells: np.ndarray, seed: tuple[int, int]
) -> np.ndarray:
    """Which attitudes (a,) are reached in cells of these indices (c, 3): (c, a). Drawn from the seed alone."""
    random, chain = np.random.default_rng(seed), chain_to_tool(searcher.robot, searcher.end_effector)
    positions, rotations = grid.positions(cells), grid.rotation.reshape(-1, 3, 3)
    possible = within_last_joint(searcher.robot.name, chain, positions, rotations).reshape(-1)
    position, attitude = np.repeat(positions, len(quaternion), axis=0), np.tile(quaternion, (len(cells), 1))
    found = np.zeros((len(possible), searcher.robot.num_joints))
    reached = np.zeros(len(possible), dtype=bool)
    found[possible], reached[possible] = search_poses(
        searcher, position[possible], attitude[possible], random
    )
    neighbours = _neighbours(cells, rotations)
    for _ in range(NEIGHBOUR_ROUNDS):
        left = np.flatnonzero(possible & ~reached)
        # Of each pose's solved neighbours one is drawn: the largest of random numbers.
        usable = reached[neighbours[left]] & (neighbours[left] >= 0)
        draw = np.where(usable, random.random(usable.shape), -1.0)
        near = neighbours[left][np.arange(len(left)), np.argmax(draw, axis=1)]
        some = usable.any(axis=1)
        left, near = left[some], near[some]
        if not len(left):
            break
        q, met = searcher.solve(position[left], attitude[left], found[near], np.full(len(left), -1))
        found[left[met]], reached[left[met]] = q[met], True
        if not met.any():
            break
    return reached.reshape(len(cells), -1)


def _neighbours(cells: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Indices (c a, k) of the poses next to each pose of a block, cell by cell; -1 where there is none."""
    a = len(rotations)
    # The six attitudes that are nearest: the largest traces of the relative rotation.
    trace = np.einsum("aij,bij->ab", rotations, rotations) - 4 * np.eye(a)
    nearest = np.argsort(-trace, axis=1, kind="stable")[:, : min(6, a - 1)]
    beside = np.arange(len(cells))[:, None, None] * a + nearest[None]
    away = np.abs(cells[:, None] - cells[None]).sum(axis=-1)
    near_cells = np.argsort(away + 10 * np.eye(len(cells), dtype=int), axis=1, kind="stable")[:, :6]
    apart = np.take_along_axis(away, near_cells, axis=1)
    same = np.where((apart == 1)[:, None], near_cells[:, None] * a + np.arange(a)[None, :, None], -1)
    return np.concatenate([beside, same], axis=2).reshape(len(cells) * a, -1)
