"""The mesh files of an MJCF model, handed to MuJoCo; a missing one that only draws is left out."""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from typing import Any

from jffsr.errors import InputError
from jffsr.robots.formats.mesh_files import mesh_bytes


def give_meshes(spec: Any, shown: str, folder: Path) -> list[str]:
    """Read every mesh file into the specification; sentences about those that are left out.

    A mesh that a body's inertia is computed from cannot be left out: InputError names the body.
    """
    import mujoco

    notes, assets = [], {}
    directory = PurePosixPath(spec.compiler.meshdir)
    for number, mesh in enumerate(list(spec.meshes)):
        if not mesh.file:
            continue
        name = mesh.name or PurePosixPath(mesh.file).stem
        within = PurePosixPath(mesh.file).name if spec.strippath else mesh.file
        path = folder / directory / within
        try:
            content = mesh_bytes(path)
        except InputError as error:
            notes.append(f"mesh '{name}' is left out: {error}")
            _leave_out(spec, mesh, name, f"{shown}: {{}}mesh '{name}': {error}", mujoco)
            continue
        mesh.name = name
        mesh.file = f"{number}{path.suffix}"
        assets[mesh.file] = content
    spec.compiler.meshdir = ""
    spec.meshdir = ""
    spec.assets = assets
    return notes


def _leave_out(spec: Any, mesh: Any, name: str, refusal: str, mujoco: Any) -> None:
    always = spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    for geom in list(spec.geoms):
        if geom.meshname != name:
            continue
        body = geom.parent
        if always or not body.explicitinertial:
            raise InputError(refusal.format(f"body '{body.name}': its inertia comes from its geoms, and "))
        spec.delete(geom)
    spec.delete(mesh)
