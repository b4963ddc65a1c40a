"""Where and how a capability map asks: cells around the first joint, directions on a sphere, rolls about each."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from jffsr.capture.inverse_kinematics_chain import Chain, chain_to_tool
from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.spatial.rotation import axis_angle_to_matrix, frame_along

CUBE = (
    4  # cells along the edge of the cubes that cells are sorted by, so that neighbours are searched together
)
_GOLDEN = np.pi * (3 - np.sqrt(5))
_PARALLEL = 1 - 1e-12


@dataclass(frozen=True, eq=False)
class PoseGrid:
    """The poses that a map asks for, all in B and on the host.

    origin (3,), m, the centre of cell (0, 0, 0); spacing, m; shape, the numbers of cells along x, y, z; cells (c, 3),
    indices of those that are searched, in an order that keeps neighbours together; direction (d, 3), unit vectors of
    the tool's x axis; rotation (d, r, 3, 3), E to B, the attitudes with it there.
    """

    origin: np.ndarray
    spacing: float
    shape: tuple[int, int, int]
    cells: np.ndarray
    direction: np.ndarray
    rotation: np.ndarray

    def positions(self, cells: np.ndarray) -> np.ndarray:
        """Centres (k, 3), m, of cells of these indices (k, 3)."""
        return self.origin + self.spacing * cells


def pose_grid(
    robot: Robot, end_effector: str | None, cells: int, directions: int, rolls: int
) -> tuple[PoseGrid, Chain]:
    """About `cells` cubic cells in the ball that the tool cannot leave, and the arm's chain.

    Directions are those of a Fibonacci spiral, z = 1 - (2 k + 1)/d at azimuth k pi (3 - sqrt 5), and rolls equal parts
    of a turn. An arm whose joints all turn about parallel axes, along x, y or z of B, gets one layer of cells in its
    plane, directions equally spaced in it and no rolls. Raises InputError for numbers that are not positive, an arm
    with too few joints to reach any pose, and a slide without limits.
    """
    for name, value in (("cells", cells), ("directions", directions), ("rolls", rolls)):
        if not value >= 1:
            raise InputError(f"capability map: {name} is {value}; a positive number is expected")
    chain = chain_to_tool(robot, end_effector)
    normal = _normal(chain)
    needed = 6 if normal is None else 3
    if len(chain.joints) < needed:
        raise InputError(
            f"capability map: the arm of '{robot.name}' has {len(chain.joints)} joints; with fewer than {needed} it "
            f"reaches next to none of the poses {'in space' if needed == 6 else 'in its plane'}"
        )
    anchor, reach = np.asarray(chain.offset[0]), reach_of_chain(robot.name, chain)
    axis = None if normal is None else int(np.argmax(np.abs(normal)))
    if axis is None:
        spacing = reach * (4 / 3 * np.pi / cells) ** (1 / 3)
        direction, rotation = sphere_attitudes(directions, rolls)
    else:
        spacing = reach * (np.pi / cells) ** 0.5
        anchor = np.where(np.arange(3) == axis, _zero_tool(chain)[0], anchor)
        direction, rotation = plane_attitudes(directions, normal, _zero_tool(chain)[1])
    across = int(np.ceil(2 * reach / spacing)) + 2
    shape = tuple(1 if k == axis else across for k in range(3))
    origin = anchor - 0.5 * spacing * (np.array(shape) - 1)
    indices = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1).reshape(-1, 3)
    inside = np.linalg.norm(origin + spacing * indices - anchor, axis=1) <= reach
    indices = indices[inside]
    order = np.lexsort((*indices.T[::-1], *(indices.T[::-1] // CUBE)))
    return PoseGrid(origin, float(spacing), shape, indices[order], direction, rotation), chain


def sphere_attitudes(directions: int, rolls: int) -> tuple[np.ndarray, np.ndarray]:
    """Directions (d, 3) spread on a sphere, and rotations (d, r, 3, 3) whose first column they are."""
    k = np.arange(directions)
    z = 1 - (2 * k + 1) / directions
    ring, azimuth = np.sqrt(1 - z * z), _GOLDEN * k
    direction = np.stack([ring * np.cos(azimuth), ring * np.sin(azimuth), z], axis=1)
    frame = np.asarray(frame_along(jnp.asarray(direction)))
    first = np.stack([frame[..., 2], frame[..., 0], frame[..., 1]], axis=-1)
    turns = [np.asarray(axis_angle_to_matrix(np.eye(3)[0], 2 * np.pi * j / rolls)) for j in range(rolls)]
    return direction, first[:, None] @ np.stack(turns)[None]


def plane_attitudes(directions: int, normal: np.ndarray, zero: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The attitude (3, 3) at joint positions zero turned about the normal by equal parts: (d, 3) and (d, 1, 3, 3)."""
    turns = [
        np.asarray(axis_angle_to_matrix(normal, 2 * np.pi * k / directions)) @ zero for k in range(directions)
    ]
    return np.stack(turns)[:, :, 0], np.stack(turns)[:, None]


def reach_of_chain(name: str, chain: Chain) -> float:
    """A length, m, that the tool is never farther from the first joint; InputError for a slide without limits."""
    return float(chain.length) + _slides(name, chain)


def _slides(name: str, chain: Chain) -> float:
    ways = np.maximum(np.abs(chain.lower), np.abs(chain.upper))[~np.array(chain.turning)]
    if not np.all(np.isfinite(ways)):
        raise InputError(
            f"capability map: a sliding joint of '{name}' has no limits, so its reach has no end"
        )
    return float(np.sum(ways))


def within_last_joint(name: str, chain: Chain, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Which of the poses (k, 3) and (a, 3, 3) do not ask the last joint to be out of reach, (k, a).

    The last joint is fixed in the tool's frame, or slides in it. What is left out cannot be reached.
    """
    back = np.asarray(chain.tool_rotation).T @ np.asarray(chain.tool_position)
    last = positions[:, None] - np.einsum("aij,j->ai", rotations, back)[None]
    limit = float(np.sum(np.linalg.norm(chain.offset[1:], axis=1))) + _slides(name, chain)
    return np.linalg.norm(last - np.asarray(chain.offset[0]), axis=-1) <= limit * (1 + 1e-9)


def _normal(chain: Chain) -> np.ndarray | None:
    """The direction (3,) in B, along one of its axes, that all joints turn about; None where there is none."""
    if not all(chain.turning):
        return None
    rotation, axes = np.eye(3), []
    for step in np.asarray(chain.rotation):
        rotation = rotation @ step
        axes.append(rotation[:, 2])
    normal = axes[0]
    parallel = np.abs(np.array(axes) @ normal) > _PARALLEL
    return normal if parallel.all() and np.abs(normal).max() > _PARALLEL else None


def _zero_tool(chain: Chain) -> tuple[np.ndarray, np.ndarray]:
    """Position (3,) and rotation (3, 3) in B of the tool at joint positions zero."""
    position, rotation = np.zeros(3), np.eye(3)
    for offset, step in zip(np.asarray(chain.offset), np.asarray(chain.rotation), strict=True):
        position, rotation = position + rotation @ offset, rotation @ step
    return position + rotation @ np.asarray(chain.tool_position), rotation @ np.asarray(chain.tool_rotation)
