"""Two shapes at random poses, apart and overlapping: by the package, and by MuJoCo."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from jffsr.clearance.model import ClearanceModel
from jffsr.clearance.solids import solid_of
from jffsr.robots.geometry import NUM_SIZES, Shape
from jffsr.robots.robot import Topology

TWO_BODIES = Topology("two", (), (), (), ("a", "b"), (), ())
_GEOMS = {
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "ellipsoid": mujoco.mjtGeom.mjGEOM_ELLIPSOID,
}


class Poses(NamedTuple):
    """Positions (k, 2, 3) and rotations (k, 2, 3, 3) of two bodies."""

    position: np.ndarray
    rotation: np.ndarray


def random_poses(count: int, generator: np.random.Generator) -> Poses:
    rotation = Rotation.random(2 * count, random_state=generator).as_matrix().reshape(count, 2, 3, 3)
    return Poses(generator.uniform(-1, 1, (count, 2, 3)), rotation)


def random_shape(kind: str, generator: np.random.Generator, **changes) -> Shape:
    size = generator.uniform(0.2, 0.6, NUM_SIZES[kind])
    return Shape(kind, kind, "body", np.zeros(3), np.eye(3), changes.get("size", size))


def two_solids(a: Shape, b: Shape, as_capsule: bool = False) -> ClearanceModel:
    """The model of two free bodies with a shape each."""
    by_body = {0: [solid_of(a, 0, as_capsule)], 1: [solid_of(b, 1, as_capsule)]}
    return ClearanceModel.of_solids(TWO_BODIES, by_body, [(0, 1)])


def mujoco_distances(a: Shape, b: Shape, poses: Poses) -> np.ndarray:
    """Signed distances (k,), m, as MuJoCo finds them."""
    spec = mujoco.MjSpec()
    for shape in (a, b):
        body = spec.worldbody.add_body()
        body.add_freejoint()
        body.add_geom(type=_GEOMS[shape.kind], size=np.resize([*shape.size, 0.0, 0.0], 3))
    model = spec.compile()
    model.opt.ccd_iterations, model.opt.ccd_tolerance = 200, 1e-10
    data = mujoco.MjData(model)
    found = []
    for position, rotation in zip(*poses, strict=True):
        quaternion = Rotation.from_matrix(rotation).as_quat(scalar_first=True)
        data.qpos[:] = np.concatenate([position, quaternion], axis=1).ravel()
        mujoco.mj_kinematics(model, data)
        found.append(mujoco.mj_geomDistance(model, data, 0, 1, 10.0, None))
    return np.array(found)


def largest_gap(a: Shape, b: Shape, position: np.ndarray, rotation: np.ndarray, normals: np.ndarray):
    """Largest gap, m, of two shapes along the unit vectors (d, 3): from below, their signed distance."""
    away = normals @ (position[1] - position[0])
    return np.max(away - _reach(a, normals @ rotation[0]) - _reach(b, normals @ rotation[1]))


def _reach(shape: Shape, n: np.ndarray) -> np.ndarray:
    size = shape.size
    if shape.kind == "box":
        return np.abs(n) @ size
    if shape.kind == "ellipsoid":
        return np.linalg.norm(n * size, axis=1)
    half = size[1] if shape.kind != "sphere" else 0.0
    round_part = size[0] * (np.linalg.norm(n[:, :2], axis=1) if shape.kind == "cylinder" else 1.0)
    return round_part + half * np.abs(n[:, 2])
