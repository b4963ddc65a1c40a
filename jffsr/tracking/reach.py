"""What a tool can surely not do: leave the arm's reach, or pass through the base's own body.

No search stands behind it. A path that is called out of reach is; one that is not may still be.
"""

from __future__ import annotations

import numpy as np

from jffsr.dynamics.base_mode import FIXED
from jffsr.robots.geometry import COLLISION
from jffsr.robots.robot import REVOLUTE, Robot


def reach(robot: Robot, end_effector: str | None = None, base_mode: str = "floating") -> float:
    """A length, m, that the tool's distance never exceeds, from the system's centre of mass, or on a fixed base from
    the base's.

    With the arm's parts in a line: the sum of m_i d_i over the total mass, d_i being the longest way from the centre
    of mass of body i along the tree to the tool. Infinite where a sliding joint has no limits. On the host.
    """
    index = robot.end_effector_index(end_effector)
    tool_body, tool = (
        robot.topology.end_effector_bodies[index],
        np.asarray(robot.end_effector_position[index]),
    )
    bodies = [0] if base_mode == FIXED else range(robot.num_joints + 1)
    weights = np.asarray(robot.mass)[list(bodies)]
    longest = [_longest_way(robot, body, tool_body, tool) for body in bodies]
    return float(np.sum(weights * longest) / np.sum(weights))


def _longest_way(robot: Robot, body: int, tool_body: int, tool: np.ndarray) -> float:
    """From the centre of mass of a body to the tool, m: distances within rigid bodies, added up along the tree."""
    up, down = _ancestry(robot, body), _ancestry(robot, tool_body)
    common = max(set(up) & set(down))
    com = np.zeros(3) if body == 0 else np.asarray(robot.link_com[body - 1])
    length, here = _climb(robot, up[: up.index(common)], com)
    rest, there = _climb(robot, down[: down.index(common)], tool)
    return length + rest + float(np.linalg.norm(here - there))


def _ancestry(robot: Robot, body: int) -> list[int]:
    found = [body]
    while found[-1] > 0:
        found.append(robot.topology.parents[found[-1] - 1])
    return found


def _climb(robot: Robot, bodies: list[int], point: np.ndarray) -> tuple[float, np.ndarray]:
    """The way from a point of the first body to the last one's parent, and where it arrives there."""
    length = 0.0
    for body in bodies:
        joint = body - 1
        length += float(np.linalg.norm(point))
        if robot.topology.joint_types[joint] != REVOLUTE:
            ends = robot.limits.position_lower[joint], robot.limits.position_upper[joint]
            length += float(np.max(np.abs(ends)))
        point = np.asarray(robot.joint_position[joint])
    return length, point


def inside_base(
    robot: Robot, base_position: np.ndarray, base_rotation: np.ndarray, points: np.ndarray
) -> np.ndarray:
    """Which points (k, 3) in I lie inside a solid of the base, with the base at these poses, (k, 3) and (k, 3, 3).

    Meshes are not looked at. Boolean (k,), on the host.
    """
    local = np.einsum("kji,kj->ki", np.asarray(base_rotation), np.asarray(points) - np.asarray(base_position))
    found = np.zeros(len(local), dtype=bool)
    for shape in robot.geometry.on_body(robot.body_names[0], COLLISION):
        found |= shape.contains(local)
    return found
