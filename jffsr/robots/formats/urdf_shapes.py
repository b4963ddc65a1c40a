"""The visual and collision shapes of a URDF."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from jffsr.errors import InputError
from jffsr.reading.xml_tree import Node
from jffsr.robots.formats.mesh_files import find_mesh, read_mesh
from jffsr.robots.formats.rpy import rpy_to_matrix
from jffsr.robots.formats.xml_values import number, numbers
from jffsr.robots.geometry import BOX, CAPSULE, COLLISION, CYLINDER, MESH, SPHERE, VISUAL, Shape

Colour = tuple[float, float, float, float]


def read_shapes(links: list[Node], folder: Path) -> tuple[list[Shape], list[str]]:
    """The shapes of all links in the frames of their links, and a sentence for each that is left out.

    Shapes have no part in the dynamics, so that one whose mesh is missing does not stop the robot.
    """
    shapes, notes = [], []
    colours = _colours(links[0].parent) if links else {}
    meshes: dict[tuple, tuple[np.ndarray, np.ndarray]] = {}
    for link in links:
        body = link.get("name")
        for role in (VISUAL, COLLISION):
            for count, node in enumerate(link.all(role)):
                label = f"{body}_{role}_{count}"
                place = f"{node.place}: link '{body}': {role} shape"
                try:
                    shapes.append(_shape(node, role, label, body, place, colours, folder, meshes))
                except _LeftOut as reason:
                    notes.append(f"link '{body}': {role} shape left out: {reason}")
    return shapes, notes


class _LeftOut(Exception):
    """Why a shape cannot be drawn."""


def _shape(node, role, label, body, place, colours, folder, meshes) -> Shape:
    origins, geometries = node.all("origin"), node.all("geometry")
    solids = geometries[0].children if geometries else []
    if not solids:
        raise InputError(f"{place}: it has no <geometry> with a shape in it")
    position, rotation = np.zeros(3), np.eye(3)
    if origins:
        position = numbers(origins[0], "xyz", 3, place, (0, 0, 0))
        rotation = rpy_to_matrix(tuple(float(a) for a in numbers(origins[0], "rpy", 3, place, (0, 0, 0))))
    solid = solids[0]
    content = {}
    if solid.tag == "box":
        kind, size = BOX, numbers(solid, "size", 3, place) / 2
    elif solid.tag == "sphere":
        kind, size = SPHERE, np.array([number(solid, "radius", place)])
    elif solid.tag in ("cylinder", "capsule"):
        kind = CYLINDER if solid.tag == "cylinder" else CAPSULE
        size = np.array([number(solid, "radius", place), number(solid, "length", place) / 2])
    elif solid.tag == "mesh":
        kind, size = MESH, np.zeros(0)
        content = dict(zip(("vertices", "faces"), _mesh(solid, place, folder, meshes), strict=True))
    else:
        raise _LeftOut(f"geometry <{solid.tag[:60]}> is not known")
    if kind != MESH and not np.all(size > 0):
        raise _LeftOut(f"the {kind} has a size that is not positive")
    return Shape(
        name=label, kind=kind, body=body, position=position, rotation=rotation, size=size, roles=(role,),
        colour=_colour(node, colours, place), **content,
    )  # fmt: skip


def _mesh(solid: Node, place: str, folder: Path, meshes: dict):
    name = solid.get("filename")
    scale = numbers(solid, "scale", 3, place, (1, 1, 1))
    if not np.all(scale):
        raise _LeftOut(f"mesh '{name}' has a scale of zero")
    path = find_mesh(name, folder) if name else None
    if path is None:
        raise _LeftOut(f"mesh file '{name}' is not found")
    key = (path, tuple(scale))
    if key not in meshes:
        try:
            meshes[key] = read_mesh(path, scale)
        except InputError as error:
            raise _LeftOut(str(error)) from None
    return meshes[key]


def _colours(robot: Node | None) -> dict[str, Colour]:
    found = {}
    for material in robot.all("material") if robot else []:
        colour = _rgba(material, material.place)
        if colour is not None:
            found[material.get("name")] = colour
    return found


def _colour(node: Node, colours: dict[str, Colour], place: str) -> Colour | None:
    for material in node.all("material"):
        return _rgba(material, place) or colours.get(material.get("name"))
    return None


def _rgba(material: Node, place: str) -> Colour | None:
    for colour in material.all("color"):
        red, green, blue, alpha = (float(x) for x in np.clip(numbers(colour, "rgba", 4, place), 0, 1))
        return red, green, blue, alpha
    return None
