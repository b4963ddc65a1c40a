"""Writing a robot to a file that other programs read."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from jffsr.errors import InputError
from jffsr.robots.formats.export_mjcf import to_mjcf
from jffsr.robots.formats.export_urdf import urdf_text
from jffsr.robots.formats.export_xml import unique
from jffsr.robots.geometry import MESH, Shape
from jffsr.robots.robot import Robot


def save_robot(robot: Robot, path: str | Path) -> None:
    """Write a robot to a .urdf file, or to an .xml or .mjcf file as MJCF.

    A URDF's meshes are written as OBJ files into the folder `NAME_meshes` beside it, before the file that
    names them, and each file is whole or not there. Raises InputError for another type of file, or where
    the file cannot be written. See `jffsr.to_urdf` and `jffsr.to_mjcf` for what is kept.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in (".urdf", ".xml", ".mjcf"):
        raise InputError(
            f"{path}: a robot is saved as .urdf (URDF), or .xml or .mjcf (MJCF), not as '{suffix}'"
        )
    try:
        if suffix != ".urdf":
            _write(path, to_mjcf(robot))
            return
        folder = path.with_name(f"{path.stem}_meshes")
        files: dict[str, str] = {}
        taken: set[str] = set()
        for shape in robot.geometry.shapes:
            if shape.kind == MESH:
                folder.mkdir(exist_ok=True)
                plain = "".join(c if c.isalnum() or c in "-_." else "_" for c in shape.name)
                name = unique(plain[:100], taken) + ".obj"
                _write(folder / name, obj_text(shape))
                files[shape.name] = f"{folder.name}/{name}"
        _write(path, urdf_text(robot, files))
    except OSError as error:
        raise InputError(
            f"{path}: the file cannot be written ({(error.strerror or str(error)).lower()})"
        ) from None


def obj_text(shape: Shape) -> str:
    """A mesh as Wavefront OBJ, numbers with 17 digits."""
    vertices = np.asarray(shape.vertices, dtype=float).tolist()
    faces = (np.asarray(shape.faces) + 1).tolist()
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices] + [f"f {i} {j} {k}" for i, j, k in faces]
    return "\n".join(lines) + "\n"


def _write(path: Path, text: str) -> None:
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
