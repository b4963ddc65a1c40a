"""Mesh files: where a robot file means, and what is in them, read by MuJoCo."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from jffsr.errors import InputError
from jffsr.reading.files import read_bytes
from jffsr.robots.formats.rpy import quaternion_to_matrix

SUFFIXES = (".stl", ".obj", ".msh")
MAX_BYTES = 100_000_000


def find_mesh(filename: str, folder: Path) -> Path | None:
    """The file that a URDF's mesh name means, None if there is none.

    A package:// name is looked for below the file's folder and each folder above it, with the package's
    name and without.
    """
    scheme, _, rest = filename.replace("\\", "/").rpartition("://")
    if scheme in ("package", "model"):
        _, _, within = rest.partition("/")
        above = (folder.absolute(), *folder.absolute().parents)
        places = [place / part for place in above for part in (rest, within) if part]
    else:
        places = [folder / rest]
    return next((place for place in places if _is_file(place)), None)


def _is_file(place: Path) -> bool:
    try:
        return place.is_file()
    except (OSError, ValueError):
        return False


def mesh_bytes(path: Path) -> bytes:
    """The file's content; InputError where it is not a mesh file of a supported kind that can be read."""
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"{path.name}: meshes of type '{path.suffix}' are not read (STL and OBJ are)")
    return read_bytes(path, path.name, "a mesh file", MAX_BYTES)


def read_mesh(path: Path, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (v, 3), m, in the file's frame, scaled, and faces (f, 3); InputError where it is no mesh."""
    import mujoco

    name = "mesh" + path.suffix.lower()
    spec = mujoco.MjSpec()
    # A shell needs no closed surface; nobody asks for the mesh's inertia.
    spec.add_mesh(name="mesh", file=name, scale=scale, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="mesh", contype=0, conaffinity=0)
    spec.assets = {name: mesh_bytes(path)}
    try:
        model = spec.compile()
    except ValueError as error:
        words = " ".join(str(error).split()).removeprefix("Error: ").partition(" Element name ")[0]
        raise InputError(f"{path.name}: {words}") from None
    return compiled_mesh(model, 0)


def compiled_mesh(model, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of a compiled mesh, moved back: MuJoCo turns meshes into their principal axes."""
    first, count = model.mesh_vertadr[number], model.mesh_vertnum[number]
    vertices = np.array(model.mesh_vert[first : first + count], dtype=float)
    first, count = model.mesh_faceadr[number], model.mesh_facenum[number]
    faces = np.array(model.mesh_face[first : first + count], dtype=np.int64)
    turn = quaternion_to_matrix(model.mesh_quat[number])
    return vertices @ turn.T + model.mesh_pos[number], faces
