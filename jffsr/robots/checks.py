"""What no link, joint, shape or name of a robot may be, each refused in one sentence."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import numpy as np

from jffsr.errors import InputError
from jffsr.robots.description import FIXED, JointDescription, LinkDescription, RobotDescription
from jffsr.robots.geometry import KINDS, MESH, NUM_SIZES, Shape
from jffsr.robots.robot import PRISMATIC, REVOLUTE

# Published tables are rounded: a triangle inequality may be missed by this share of the largest moment.
_TRIANGLE_SLACK = 1e-9
# Beside a length beyond this, in m, the others of a robot would be lost to rounding.
_LONGEST = 1e6


def check_link(where: str, link: LinkDescription) -> None:
    """Refuse a link whose mass or inertia no rigid body can have; a bare frame passes."""
    if link.mass is not None:
        check_rigid(f"{where}: link '{link.name}'", link.mass, link.com, link.inertia)


def check_rigid(body: str, mass: float, com: np.ndarray, inertia: np.ndarray) -> None:
    """Refuse a mass (), a centre of mass (3,) or an inertia (3, 3) that no rigid body can have."""
    if not np.isfinite(mass):
        raise InputError(f"{body}: mass is {mass}; a finite number of kg is expected")
    if mass <= 0:
        raise InputError(f"{body}: mass is {mass:g} kg; it must be positive")
    if not np.all(np.isfinite(com)):
        raise InputError(f"{body}: centre of mass {com.tolist()} is not finite")
    if np.abs(com).max() > _LONGEST:
        raise InputError(f"{body}: centre of mass {com.tolist()} m is farther than {_LONGEST:g} m")
    if not np.all(np.isfinite(inertia)):
        raise InputError(f"{body}: inertia {inertia.tolist()} is not finite")
    if not np.allclose(inertia, inertia.T, rtol=0, atol=1e-9 * np.abs(inertia).max()):
        raise InputError(f"{body}: inertia is not symmetric")
    moments = np.linalg.eigvalsh(inertia)
    if moments[0] <= 0:
        raise InputError(
            f"{body}: principal moments of inertia {_numbers(moments)} kg m^2; all must be positive"
        )
    if moments[0] + moments[1] < moments[2] * (1 - _TRIANGLE_SLACK):
        raise InputError(
            f"{body}: principal moments of inertia {_numbers(moments)} kg m^2 break the triangle "
            f"inequality: {moments[0]:g} + {moments[1]:g} is less than {moments[2]:g}, which no rigid body can have"
        )


def _numbers(values: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"


def check_joint(where: str, joint: JointDescription) -> None:
    """Refuse a joint of an unknown type, without a place or an axis, or with limits that none can keep."""
    body = f"{where}: joint '{joint.name}'"
    if joint.type not in (REVOLUTE, PRISMATIC, FIXED):
        raise InputError(
            f"{body}: type '{joint.type}' is not supported; allowed are revolute, prismatic, fixed"
        )
    for what, value in (("position", joint.position), ("rotation", joint.rotation), ("axis", joint.axis)):
        if not np.all(np.isfinite(value)):
            raise InputError(f"{body}: {what} {np.asarray(value).tolist()} is not finite")
    if np.abs(joint.position).max() > _LONGEST:
        raise InputError(f"{body}: position {joint.position.tolist()} m is farther than {_LONGEST:g} m")
    if not is_rotation(joint.rotation):
        raise InputError(f"{body}: rotation is not a rotation matrix")
    if joint.type != FIXED and np.linalg.norm(joint.axis) < 1e-12:
        raise InputError(f"{body}: axis {joint.axis.tolist()} has length zero")
    low, high = joint.position_limit
    if np.isnan(low) or np.isnan(high) or not low < high:
        raise InputError(
            f"{body}: position limits [{low:g}, {high:g}]; the lower must be less than the upper"
        )
    for what in ("velocity_limit", "acceleration_limit", "torque_limit"):
        value = getattr(joint, what)
        if not value > 0:
            raise InputError(f"{body}: {what.replace('_', ' ')} is {value:g}; it must be positive")


def check_pose(at: Callable[[str], str], position: np.ndarray, rotation: np.ndarray) -> None:
    """Refuse a place that is none; `at` says for the keys position and rpy_deg where they stand."""
    if not np.all(np.isfinite(position)):
        raise InputError(f"{at('position')}: {position.tolist()} is not finite")
    if not np.all(np.isfinite(rotation)) or not is_rotation(rotation):
        raise InputError(f"{at('rpy_deg')}: found what is no rotation; finite angles are expected")


def is_rotation(matrix: np.ndarray) -> bool:
    """Whether the matrix is orthogonal and right-handed."""
    return np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-9) and bool(np.linalg.det(matrix) > 0)


def check_names(description: RobotDescription) -> None:
    """Refuse a name that is given twice or that nothing has, and poses and shapes that are none."""
    where = description.origin
    for what, items in (
        ("links", description.links),
        ("joints", description.joints),
        ("end effectors", description.end_effectors),
    ):
        counts = Counter(item.name for item in items)
        twice = [name for name, count in counts.items() if count > 1]
        if twice:
            raise InputError(f"{where}: two {what} are named '{twice[0]}'; names must differ")
    links = {link.name for link in description.links}
    for joint in description.joints:
        for role, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in links:
                raise InputError(f"{where}: joint '{joint.name}': {role} link '{name}' does not exist")
    for tool in description.end_effectors:
        if tool.link not in links:
            raise InputError(f"{where}: end effector '{tool.name}': link '{tool.link}' does not exist")
        if not np.all(np.isfinite(tool.position)) or not np.all(np.isfinite(tool.rotation)):
            raise InputError(f"{where}: end effector '{tool.name}': its pose is not finite")
        if not is_rotation(tool.rotation):
            raise InputError(f"{where}: end effector '{tool.name}': rotation is not a rotation matrix")
    for shape in description.shapes:
        if shape.body not in links:
            raise InputError(f"{where}: shape '{shape.name}': link '{shape.body}' does not exist")
        check_shape(f"{where}: link '{shape.body}': shape '{shape.name}'", shape)


def check_shape(place: str, shape: Shape) -> None:
    """Refuse a shape of an unknown kind, size or place."""
    if shape.kind not in KINDS:
        raise InputError(f"{place}: kind '{shape.kind}' is not known; allowed are {', '.join(KINDS)}")
    for what, value in (("position", shape.position), ("rotation", shape.rotation)):
        if not np.all(np.isfinite(value)):
            raise InputError(f"{place}: {what} {np.asarray(value).tolist()} is not finite")
    if not is_rotation(shape.rotation):
        raise InputError(f"{place}: rotation is not a rotation matrix")
    count = NUM_SIZES[shape.kind]
    if shape.size.shape != (count,) or not np.all(np.isfinite(shape.size)) or np.any(shape.size <= 0):
        raise InputError(
            f"{place}: size {shape.size.tolist()}; a {shape.kind} needs {count} positive numbers"
        )
    if shape.kind != MESH:
        return
    if shape.vertices is None or shape.faces is None or not len(shape.vertices) or not len(shape.faces):
        raise InputError(f"{place}: the mesh has no vertices or no faces")
    if not np.all(np.isfinite(shape.vertices)):
        raise InputError(f"{place}: the mesh has vertices that are not finite")
    if shape.faces.min() < 0 or shape.faces.max() >= len(shape.vertices):
        raise InputError(f"{place}: the mesh has faces that name vertices it does not have")
