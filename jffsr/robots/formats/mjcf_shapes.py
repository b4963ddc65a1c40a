"""The geoms of a compiled MJCF model as shapes."""

from __future__ import annotations

from typing import Any

import numpy as np

from jffsr.robots.formats.mesh_files import compiled_mesh
from jffsr.robots.formats.rpy import quaternion_to_matrix
from jffsr.robots.geometry import (
    BOX,
    CAPSULE,
    COLLISION,
    CYLINDER,
    ELLIPSOID,
    MESH,
    NUM_SIZES,
    SPHERE,
    VISUAL,
    Shape,
)

COLLISION_GROUP = 3
"""Geoms of this group and above are not drawn by MuJoCo's viewer: they are there for contact."""
_DEFAULT_COLOUR = (0.5, 0.5, 0.5, 1.0)


def read_shapes(spec: Any, model: Any, bodies: list[str], shift: np.ndarray) -> tuple[list[Shape], list[str]]:
    """Shapes in the frames of their links, which are the bodies' moved by `shift`, and what was left out.

    A geom that touches nothing is visual, one of group 3 and above is for collision, any other is both.
    """
    import mujoco

    kinds = {
        mujoco.mjtGeom.mjGEOM_BOX: BOX, mujoco.mjtGeom.mjGEOM_SPHERE: SPHERE,
        mujoco.mjtGeom.mjGEOM_CYLINDER: CYLINDER, mujoco.mjtGeom.mjGEOM_CAPSULE: CAPSULE,
        mujoco.mjtGeom.mjGEOM_ELLIPSOID: ELLIPSOID, mujoco.mjtGeom.mjGEOM_MESH: MESH,
    }  # fmt: skip
    shapes, notes = [], []
    for geom in range(model.ngeom):
        body = int(model.geom_bodyid[geom])
        kind = kinds.get(mujoco.mjtGeom(model.geom_type[geom]))
        name = model.geom(geom).name or f"{bodies[body]}_geom_{geom - model.body_geomadr[body]}"
        if kind is None:
            word = mujoco.mjtGeom(model.geom_type[geom]).name.removeprefix("mjGEOM_").lower()
            notes.append(f"body '{bodies[body]}': geom of type {word} left out")
            continue
        position, rotation = np.array(model.geom_pos[geom]), quaternion_to_matrix(model.geom_quat[geom])
        content = {}
        if kind == MESH:
            mesh = int(model.geom_dataid[geom])
            vertices, faces = compiled_mesh(model, mesh)
            content = {"vertices": vertices, "faces": faces}
            # The compiled pose is that of the mesh's principal axes; the vertices are back in the file's.
            rotation = rotation @ quaternion_to_matrix(model.mesh_quat[mesh]).T
            position = position - rotation @ model.mesh_pos[mesh]
        shapes.append(
            Shape(
                name=name,
                kind=kind,
                body=bodies[body],
                position=position - shift[body],
                rotation=rotation,
                size=np.array(model.geom_size[geom, : NUM_SIZES[kind]]),
                roles=_roles(model, geom),
                colour=_colour(model, geom),
                **content,
            )
        )
    return shapes, notes


def _roles(model: Any, geom: int) -> tuple[str, ...]:
    if not model.geom_contype[geom] and not model.geom_conaffinity[geom]:
        return (VISUAL,)
    return (COLLISION,) if model.geom_group[geom] >= COLLISION_GROUP else (VISUAL, COLLISION)


def _colour(model: Any, geom: int) -> tuple[float, float, float, float] | None:
    # Colours are of single precision in MuJoCo: 0.2 comes back as 0.20000000298.
    red, green, blue, alpha = (round(float(x), 7) for x in model.geom_rgba[geom])
    if model.geom_matid[geom] >= 0 and (red, green, blue, alpha) == _DEFAULT_COLOUR:
        red, green, blue, alpha = (round(float(x), 7) for x in model.mat_rgba[model.geom_matid[geom]])
    elif (red, green, blue, alpha) == _DEFAULT_COLOUR:
        return None
    return red, green, blue, alpha
