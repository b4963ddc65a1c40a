"""What a robot's bodies look like: the shapes of its file, or others made from masses, inertias and joints."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from jffsr.robots.geometry import MESH, VISUAL, Geometry
from jffsr.robots.robot import Robot
from jffsr.viz.replay.meshes import merged, triangles
from jffsr.viz.replay.replay import Colour
from jffsr.viz.scene import Scene
from jffsr.viz.solids import capsule_between, cylinder_between, shape_faces

BASE: Colour = (0.76, 0.79, 0.84)
LINKS: tuple[Colour, Colour] = ((0.42, 0.58, 0.78), (0.88, 0.90, 0.93))
"""In turn, so that neighbours differ."""
JOINT: Colour = (0.28, 0.31, 0.36)
TOOL: Colour = (0.50, 0.53, 0.58)
TARGET: Colour = (0.87, 0.70, 0.45)

_THIN, _THICK = 0.045, 0.13
"""The radius of a link, as shares of the arm's longest straight piece."""


class Part(NamedTuple):
    """A piece of a robot that moves with one body: vertices (v, 3), m, in that body's frame, and triangles (t, 3).

    joint is the number of the joint that it is the housing of, None for anything else.
    """

    name: str
    body: int
    vertices: np.ndarray
    faces: np.ndarray
    colour: Colour
    joint: int | None = None


class Bare(NamedTuple):
    """A piece of a robot whose file shows nothing there: as `Part`, with faces (f, 4, 3), m, that look outwards."""

    name: str
    body: int
    faces: np.ndarray
    colour: Colour
    joint: int | None = None


def robot_parts(robot: Robot, scene: Scene) -> list[Part]:
    """All pieces of a robot, from the scene of a motion of it.

    A body that its file gives shapes to be seen by has those; the others as in `bare_parts`.
    """
    parts = []
    for body, name in enumerate(robot.body_names):
        shapes = robot.geometry.on_body(name, VISUAL)
        for number, (colour, mesh) in enumerate(_by_colour(shapes, _colour(body)).items()):
            parts.append(Part(name if not number else f"{name} {number + 1}", body, *mesh, colour))
    whole: dict[tuple[str, int], list[Bare]] = {}
    for bare in bare_parts(robot, scene):
        whole.setdefault((bare.name, bare.body), []).append(bare)
    for (name, body), pieces in whole.items():
        mesh = merged([triangles(piece.faces) for piece in pieces])
        parts.append(Part(name, body, *mesh, pieces[0].colour, pieces[0].joint))
    return parts


def bare_parts(robot: Robot, scene: Scene) -> list[Bare]:
    """What the bodies without shapes look like, from the scene of a motion; pieces of one name are one solid.

    The base is the uniform box of its mass and inertia, and a link a round tube from joint to joint, as thick as a rod
    of its mass that turns about itself as hard as the link about its easiest axis, within what looks like an arm; a
    joint is a housing along its axis, a tool a disc.
    """
    names, parts = robot.body_names, []
    bare = [body for body, name in enumerate(names) if not robot.geometry.on_body(name, VISUAL)]
    if 0 in bare:
        parts.append(Bare(names[0], 0, _into_body(scene, 0, scene.base_faces[0]), BASE))
    radii = _radii(robot, _longest(scene))
    for body in bare:
        label = f"{names[body]} link" if body else f"{names[0]} mount"
        for ends in _pieces(scene, body):
            parts.append(Bare(label, body, capsule_between(*ends, radii[body]), _colour(body)))
    for joint, (child, name) in enumerate(zip(range(1, len(names)), robot.joint_names, strict=True)):
        parent = robot.topology.parents[joint]
        if child in bare or parent in bare:
            radius = 1.3 * max(radii[child], radii[parent] if parent else 0.0)
            half = 1.5 * radius * scene.joint_axes[0, joint]
            # What slides moves through its housing.
            body = child if robot.topology.is_revolute[joint] else parent
            ends = _into_body(scene, body, scene.joints[0, joint] + np.stack([-half, half]))
            parts.append(Bare(f"{name} joint", body, cylinder_between(*ends, radius), JOINT, joint))
    for tool, body in enumerate(robot.topology.end_effector_bodies):
        if body in bare:
            along = 0.5 * radii[body] * scene.tool_rotation[0, tool][:, 2]
            ends = _into_body(scene, body, scene.tools[0, tool] + np.stack([-along, along]))
            disc = cylinder_between(*ends, 1.5 * radii[body])
            parts.append(Bare(f"{robot.end_effector_names[tool]} tool", body, disc, TOOL))
    return parts


def shapes_mesh(geometry: Geometry, colour: Colour) -> dict[Colour, tuple[np.ndarray, np.ndarray]]:
    """The shapes of a target to be seen by, or all where it has none of those, one mesh for each colour."""
    shapes = [shape for shape in geometry.shapes if VISUAL in shape.roles] or list(geometry.shapes)
    return _by_colour(shapes, colour)


def _by_colour(shapes, otherwise: Colour) -> dict[Colour, tuple[np.ndarray, np.ndarray]]:
    found: dict[Colour, list] = {}
    for shape in shapes:
        colour = otherwise if shape.colour is None else tuple(float(c) for c in shape.colour[:3])
        faces = shape_faces(shape)
        vertices, corners = triangles(faces)
        if shape.kind == MESH:
            # Files do not agree on which side of a triangle is outside: show both.
            corners = np.concatenate([corners, corners[:, ::-1]])
        found.setdefault(colour, []).append((vertices, corners))
    return {colour: merged(parts) for colour, parts in found.items()}


def _colour(body: int) -> Colour:
    return BASE if body == 0 else LINKS[body % 2]


def _into_body(scene: Scene, body: int, points: np.ndarray, sample: int = 0) -> np.ndarray:
    return (points - scene.origin[sample, body]) @ scene.rotation[sample, body]


def _pieces(scene: Scene, body: int) -> list[np.ndarray]:
    """The straight pieces (2, 3) of a body, in its frame; of a sliding one as long as it ever gets."""
    found = []
    for number in np.flatnonzero(scene.owners == body):
        lengths = np.linalg.norm(scene.segments[:, number, 1] - scene.segments[:, number, 0], axis=1)
        sample = int(np.argmax(lengths))
        if lengths[sample] > 0:
            found.append(_into_body(scene, body, scene.segments[sample, number], sample))
    return found


def _longest(scene: Scene) -> float:
    lengths = np.linalg.norm(scene.segments[..., 1, :] - scene.segments[..., 0, :], axis=-1)
    return float(lengths.max(initial=0.0)) or 1.0


def _radii(robot: Robot, longest: float) -> np.ndarray:
    mass, inertia = np.asarray(robot.mass), np.asarray(robot.inertia)
    least = np.maximum(np.linalg.eigvalsh(inertia)[:, 0], 0.0)
    rods = np.sqrt(np.divide(2.0 * least, mass, out=np.zeros_like(mass), where=mass > 0))
    return np.clip(rods, _THIN * longest, _THICK * longest)
