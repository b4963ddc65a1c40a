"""The share of poses that an arm reaches, cell by cell of its workspace: a capability map.

After Zacharias, Borst and Hirzinger, "Capturing robot workspace structure: representing robot capabilities", IROS 2007,
as Wang, Luo and Yu (2021) use it: the base stands still, positions are in its frame B. A floating base shifts the map,
so that a grasp found with it is confirmed by `floating_inverse_kinematics`.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.capture.capability_map_file import load_part, save_part
from jffsr.capture.capability_map_grid import pose_grid
from jffsr.capture.capability_map_search import Searcher, search_block
from jffsr.clearance.model import ClearanceModel
from jffsr.errors import InputError
from jffsr.planning.fingerprint import fingerprint
from jffsr.planning.plan import check_precision
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.spatial.rotation import matrix_to_quaternion
from jffsr.types import Array, Scalar, Vector3

BLOCK_POSES = 25_600


@register_dataclass
@dataclass(frozen=True, eq=False)
class CapabilityMap:
    """Shares of poses that an arm reaches, on a grid of cubic cells in the base frame B.

    origin (3,), m, the centre of the first cell; spacing (), m; share (nx, ny, nz), of all attitudes at a cell's
    centre; direction_share (nx, ny, nz, d), of the rolls about each of direction (d, 3), unit vectors of the tool's x
    axis. robot, end_effector, rolls and self_clearance, whether postures with bodies in contact were refused, are
    static.
    """

    origin: Array
    spacing: Array
    share: Array
    direction_share: Array
    direction: Array
    robot: str = field(metadata={"static": True})
    end_effector: str = field(metadata={"static": True})
    rolls: int = field(metadata={"static": True})
    self_clearance: bool = field(metadata={"static": True})

    def value(self, position_B: Vector3) -> Scalar:
        """The share () at a position (3,), m, in B: trilinear between cell centres, zero outside, differentiable."""
        shape = self.share.shape
        place = (jnp.asarray(position_B) - jnp.asarray(self.origin)) / self.spacing
        below = jnp.floor(place)
        rest = place - below
        below = below.astype(int)
        total = jnp.zeros_like(place[0])
        for corner in product((0, 1), repeat=3):
            weight = jnp.prod(jnp.where(np.array(corner) == 1, rest, 1 - rest))
            index = below + np.array(corner)
            inside = jnp.all((index >= 0) & (index < np.array(shape)))
            here = jnp.asarray(self.share)[tuple(jnp.clip(index, 0, np.array(shape) - 1))]
            total = total + jnp.where(inside, weight * here, 0.0)
        return total

    @property
    def axes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Coordinates, m, in B of the cell centres along x, y and z."""
        origin = np.asarray(self.origin)
        return tuple(origin[k] + float(self.spacing) * np.arange(self.share.shape[k]) for k in range(3))


def capability_map(
    robot: Robot,
    *,
    cells: int = 20_000,
    directions: int = 50,
    rolls: int = 8,
    end_effector: str | None = None,
    clearance: ClearanceModel | None = None,
    self_clearance: bool = True,
    margin: float = 0.0,
    seed: int = 0,
    checkpoint: str | os.PathLike[str] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> CapabilityMap:
    """Search an arm's workspace: about `cells` cells, `directions` of the tool's x axis, `rolls` about each.

    Directions lie on a Fibonacci spiral; a planar arm has one layer of cells, directions in its plane and no rolls. A
    pose counts where some joint positions within the limits meet it to 1e-4 m and rad and, with self_clearance, keep
    all distances of `clearance` (the robot's own bodies by default) above `margin`, m. The search may miss a pose, and
    finds none that is not there. With a `checkpoint` file every block of cells is kept, and the same call goes on from
    there; the result does not depend on where it was interrupted. progress(done, cells) is called after each block. On
    all devices (`jffsr.use_all_cores`), in float64. Raises InputError for an arm with too few joints, a robot without
    shapes where clearance is asked for, and a checkpoint of another map.
    """
    check_precision("float64")
    if not margin >= 0:
        raise InputError(f"capability map: margin is {margin} m; zero or more is expected")
    grid, _ = pose_grid(robot, end_effector, cells, directions, rolls)
    if self_clearance and clearance is None:
        clearance = ClearanceModel.create(robot)
    mark = fingerprint(robot, grid, self_clearance, clearance, margin, seed)
    turned = grid.rotation.reshape(-1, 3, 3)
    quaternion = np.asarray(jax.vmap(matrix_to_quaternion)(jnp.asarray(turned)))
    count = len(grid.cells)
    each = max(8, BLOCK_POSES // len(quaternion))
    path = None if checkpoint is None else Path(checkpoint)
    reached = (
        np.zeros((0, len(quaternion)), dtype=bool) if path is None else load_part(path, mark, len(quaternion))
    )
    searcher = Searcher.create(robot, end_effector, clearance if self_clearance else None, margin, seed)
    while len(reached) < count:
        first = len(reached)
        found = search_block(searcher, grid, quaternion, grid.cells[first : first + each], (seed, first))
        reached = np.concatenate([reached, found])
        if path is not None:
            save_part(path, mark, reached)
        if progress is not None:
            progress(len(reached), count)
    rolls_each = grid.rotation.shape[1]
    by_direction = reached.reshape(count, -1, rolls_each).mean(axis=-1)
    direction_share = np.zeros((*grid.shape, by_direction.shape[1]))
    direction_share[tuple(grid.cells.T)] = by_direction
    index = robot.end_effector_index(end_effector)
    return CapabilityMap(
        origin=grid.origin,
        spacing=np.asarray(grid.spacing),
        share=direction_share.mean(axis=-1),
        direction_share=direction_share,
        direction=grid.direction,
        robot=robot.name,
        end_effector=robot.end_effector_names[index],
        rolls=rolls_each,
        self_clearance=self_clearance,
    )
