"""Robot files read a second time, as plainly as can be, to see what a file that loads really says."""

from __future__ import annotations

import re
import warnings
import xml.etree.ElementTree as ET
from dataclasses import dataclass

import mujoco
import numpy as np
import yaml
from scipy.spatial.transform import Rotation


@dataclass
class Mass:
    """Mass, first and second moments about the origin, in the frame of the base link at joint position zero."""

    mass: float
    first: np.ndarray
    second: np.ndarray

    @classmethod
    def of(cls, parts):
        """The sum over bodies (mass, centre of mass, inertia about it)."""
        parts = list(parts)
        second = sum(inertia + m * (com @ com * np.eye(3) - np.outer(com, com)) for m, com, inertia in parts)
        return cls(sum(p[0] for p in parts), sum(p[0] * p[1] for p in parts), second)


@dataclass
class Snapshot:
    """What a file says: the whole robot's mass, and for each joint its axis, a point on it, what it moves.

    The axis of a joint that slides lies nowhere in particular: its point is zero.
    """

    whole: Mass
    joints: dict[str, tuple[np.ndarray, np.ndarray, Mass]]


def assert_same(found: Snapshot, expected: Snapshot, label: str) -> None:
    """The two agree to rounding, measured against their largest numbers."""
    assert set(found.joints) == set(expected.joints), label
    _same_mass(found.whole, expected.whole, f"{label}: whole")
    for name, (axis, point, mass) in expected.joints.items():
        _close(found.joints[name][0], axis, f"{label}: axis of {name}")
        _close(found.joints[name][1], point, f"{label}: place of {name}")
        _same_mass(found.joints[name][2], mass, f"{label}: beyond {name}")


def _same_mass(a: Mass, b: Mass, label: str) -> None:
    _close(a.mass, b.mass, label)
    _close(a.first, b.first, label)
    _close(a.second, b.second, label)


def _close(a, b, label):
    np.testing.assert_allclose(a, b, rtol=1e-8, atol=1e-8 * max(np.abs(b).max(), 1e-3), err_msg=label)


def of_robot(robot) -> Snapshot:
    """The robot that was built."""
    top = robot.topology
    places = [(np.eye(3), -np.asarray(robot.root_position))]
    for i, parent in enumerate(top.parents):
        turn, origin = places[parent]
        places.append((turn @ robot.joint_rotation[i], origin + turn @ robot.joint_position[i]))
    parts = []
    for body, (turn, origin) in enumerate(places):
        com = origin if body == 0 else origin + turn @ robot.link_com[body - 1]
        parts.append((float(robot.mass[body]), com, turn @ robot.inertia[body] @ turn.T))
    joints = {}
    for i, name in enumerate(top.joint_names):
        turn, origin = places[i + 1]
        moved = [part for part, carried in zip(parts, top.support[:, i], strict=True) if carried]
        joints[name] = (turn @ robot.joint_axis[i], origin * top.is_revolute[i], Mass.of(moved))
    return Snapshot(Mass.of(parts), joints)


def of_urdf(text: str, base: str) -> Snapshot:
    """The links and joints of a URDF text, by the standard library's reader; `base` names the frame."""
    # What the first line says about an encoding does not hold for a text that is decoded.
    root = ET.fromstring(re.sub(r"^\ufeff?<\?xml.*?\?>", "", text))
    links, joints = {}, []
    for link in root.findall("link"):
        inertial = link.find("inertial")
        links[link.get("name")] = None
        if inertial is not None:
            tensor = {key: float(value) for key, value in inertial.find("inertia").attrib.items()}
            turn, com = _origin(inertial)
            links[link.get("name")] = (
                float(inertial.find("mass").get("value")),
                com,
                turn @ _tensor(tensor, "i") @ turn.T,
            )
    for joint in root.findall("joint"):
        axis = joint.find("axis")
        kind = joint.get("type")
        vector = [1, 0, 0] if axis is None else axis.get("xyz").split()
        turn, position = _origin(joint)
        ends = joint.find("parent").get("link"), joint.find("child").get("link")
        joints.append((joint.get("name"), kind, *ends, turn, position, np.array(vector, float)))
    return _walk(links, [joint for joint in joints if joint[1] != "floating"], base)


def of_yaml(text: str, base: str) -> Snapshot:
    """The same for the readable form."""
    record = yaml.safe_load(text)
    links = {}
    for link in (record["base"], *record.get("links", ())):
        com = np.array(link.get("com", (0, 0, 0)), float)
        links[str(link["name"])] = (float(link["mass"]), com, _tensor(link["inertia"], ""))
    joints = []
    for joint in record["joints"]:
        turn = Rotation.from_euler(
            "xyz", np.deg2rad(np.fmod(np.array(joint.get("rpy_deg", (0, 0, 0)), float), 360))
        ).as_matrix()
        axis = np.array(joint.get("axis", (0, 0, 1)), float)
        position = np.array(joint.get("position", (0, 0, 0)), float)
        # A name that looks like a date is a name all the same.
        names = [str(joint[key]) for key in ("name", "type", "parent", "child")]
        joints.append((*names, turn, position, axis))
    return _walk(links, joints, base)


def of_mjcf(path) -> Snapshot | None:
    """A file as MuJoCo itself compiles it; None where it refuses, for the sake of a motor or a sensor perhaps."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            spec = mujoco.MjSpec.from_file(str(path))
            spec.compiler.fusestatic = False
            model = spec.compile()
        except ValueError:
            return None
    data = mujoco.MjData(model)
    data.qpos[:] = 0
    free = [j for j in range(model.njnt) if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_FREE]
    for joint in free:
        data.qpos[model.jnt_qposadr[joint] + 3] = 1
    mujoco.mj_kinematics(model, data)
    turn, origin = data.xmat[1].reshape(3, 3), data.xpos[1]
    parts = [(0.0, np.zeros(3), np.zeros((3, 3)))]
    for body in range(1, model.nbody):
        axes = turn.T @ data.ximat[body].reshape(3, 3)
        inertia = axes @ np.diag(model.body_inertia[body]) @ axes.T
        parts.append((float(model.body_mass[body]), turn.T @ (data.xipos[body] - origin), inertia))
    joints = {}
    for joint in (j for j in range(model.njnt) if j not in free):
        body, moved = model.jnt_bodyid[joint], []
        for other in range(1, model.nbody):
            above = other
            while above not in (0, body):
                above = model.body_parentid[above]
            moved += [parts[other]] if above == body else []
        turns = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE
        point = turn.T @ (data.xanchor[joint] - origin) * turns
        name = model.joint(joint).name or f"joint_{joint}"
        joints[name] = (turn.T @ data.xaxis[joint], point, Mass.of(moved))
    return Snapshot(Mass.of(parts), joints)


def _origin(element):
    origin = element.find("origin")
    if origin is None:
        return np.eye(3), np.zeros(3)
    rpy = [float(x) for x in origin.get("rpy", "0 0 0").split()]
    return Rotation.from_euler("xyz", rpy).as_matrix(), np.array(origin.get("xyz", "0 0 0").split(), float)


def _tensor(moments, prefix):
    get = lambda key: float(moments.get(prefix + key, 0))  # noqa: E731
    return np.array(
        [
            [get("xx"), get("xy"), get("xz")],
            [get("xy"), get("yy"), get("yz")],
            [get("xz"), get("yz"), get("zz")],
        ]
    )


def _walk(links, joints, base) -> Snapshot:
    """Forward kinematics at zero from the base, up and down the joints."""
    places, waiting = {base: (np.eye(3), np.zeros(3))}, [base]
    while waiting:
        link = waiting.pop()
        turn, origin = places[link]
        for _, _, parent, child, turned, position, _ in joints:
            if parent == link and child not in places:
                places[child] = (turn @ turned, origin + turn @ position)
                waiting.append(child)
            elif child == link and parent not in places:
                back = turn @ turned.T
                places[parent] = (back, origin - back @ position)
                waiting.append(parent)
    parts = {}
    for name, record in links.items():
        if record is not None and name in places:
            turn, origin = places[name]
            parts[name] = (record[0], origin + turn @ record[1], turn @ record[2] @ turn.T)
    found = {}
    for name, kind, _, child, _, _, axis in joints:
        if kind != "fixed":
            below = {child}
            while True:
                more = {j[3] for j in joints if j[2] in below} - below
                if not more:
                    break
                below |= more
            turn, origin = places[child]
            moved = Mass.of(part for link, part in parts.items() if link in below)
            found[name] = (turn @ axis / np.linalg.norm(axis), origin * (kind != "prismatic"), moved)
    return Snapshot(Mass.of(parts.values()), found)
