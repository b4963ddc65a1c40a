"""The robot and a free target as one MuJoCo model whose bodies can touch."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from jffsr.clearance.model import ClearanceModel
from jffsr.clearance.pairs import TARGET
from jffsr.crosscheck.mujoco_model import body_name, rotation_quaternion, to_mjspec
from jffsr.errors import InputError
from jffsr.robots.geometry import BOX, CAPSULE, COLLISION, CYLINDER, ELLIPSOID, MESH, SPHERE, Shape
from jffsr.robots.principal import principal_axes
from jffsr.robots.robot import Robot

if TYPE_CHECKING:
    import mujoco

_GEOMS = {
    SPHERE: "SPHERE", CAPSULE: "CAPSULE", CYLINDER: "CYLINDER", BOX: "BOX", ELLIPSOID: "ELLIPSOID", MESH: "MESH"
}  # fmt: skip


def to_contact_model(
    robot: Robot, clearance: ClearanceModel, step: float, target: Any | None = None
) -> mujoco.MjModel:
    """The robot of `to_mjspec` with its collision shapes, and the target as a free body behind its coordinates.

    target has mass (), inertia (3, 3) about its centre of mass, and geometry, as a Target has. Contacts are on between
    the pairs of bodies that `clearance` has, and no others. A mesh collides as its convex hull.
    """
    import mujoco

    spec = to_mjspec(robot)
    spec.option.timestep = step
    for name in ("CONSTRAINT", "CONTACT"):
        spec.option.disableflags &= ~int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{name}"))
    bodies = {name: spec.body(body_name(name)) for name in robot.body_names}
    for name, body in bodies.items():
        for shape in robot.geometry.on_body(name, COLLISION):
            _add_shape(spec, body, shape)
    if target is not None:
        bodies[TARGET] = _add_target(spec, target)
    kept = {frozenset(pair) for pair in clearance.pair_names}
    for pair in combinations(bodies, 2):
        if frozenset(pair) not in kept:
            spec.add_exclude(bodyname1=bodies[pair[0]].name, bodyname2=bodies[pair[1]].name)
    try:
        return spec.compile()
    except ValueError as error:
        reason = " ".join(str(error).split())
        raise InputError(f"MuJoCo does not accept the robot '{robot.name}': {reason}") from error


def _add_target(spec: Any, target: Any) -> Any:
    moments, axes = principal_axes(np.asarray(target.inertia, dtype=float))
    body = spec.worldbody.add_body(name=TARGET)
    body.add_freejoint()
    body.explicitinertial = True
    body.mass, body.inertia = float(target.mass), moments
    body.ipos, body.iquat = np.zeros(3), rotation_quaternion(axes)
    for shape in target.geometry.shapes:
        if COLLISION in shape.roles:
            _add_shape(spec, body, shape)
    return body


def _add_shape(spec: Any, body: Any, shape: Shape) -> None:
    import mujoco

    size = np.zeros(3)
    size[: len(shape.size)] = shape.size
    geom = body.add_geom(
        type=getattr(mujoco.mjtGeom, f"mjGEOM_{_GEOMS[shape.kind]}"),
        pos=np.asarray(shape.position, dtype=float),
        quat=rotation_quaternion(shape.rotation),
        size=size,
    )
    if shape.kind == MESH:
        name = f"{body.name}:{len(spec.meshes)}"
        mesh = spec.add_mesh(name=name, uservert=np.asarray(shape.vertices, dtype=float).ravel())
        mesh.userface = np.asarray(shape.faces, dtype=int).ravel()
        geom.meshname = name
