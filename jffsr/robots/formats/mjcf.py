"""MJCF through MuJoCo: what its compiler makes of classes, frames, angles and geoms, as a description."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from jffsr.errors import InputError
from jffsr.reading.xml_tree import Node
from jffsr.robots.description import (
    FIXED,
    EndEffectorDescription,
    JointDescription,
    LinkDescription,
    RobotDescription,
)
from jffsr.robots.formats.leaves import leaf_end_effectors
from jffsr.robots.formats.mjcf_compile import compile_mjcf
from jffsr.robots.formats.mjcf_shapes import read_shapes
from jffsr.robots.formats.mjcf_text import Prepared, prepare
from jffsr.robots.formats.rpy import quaternion_to_matrix
from jffsr.robots.robot import PRISMATIC, REVOLUTE

UNLIMITED = 1e9
"""A range beyond this has no end: MuJoCo's largest number is 1e10."""


def describe_mjcf(root: Node, shown: str, folder: Path) -> RobotDescription:
    """The description of a <mujoco> element; `shown` is the file's name, other files are named from `folder`."""
    prepared = prepare(root, shown, folder)
    spec, model = compile_mjcf(prepared, shown, folder)
    return _Reader(spec, model, prepared, shown, root).description()


class _Reader:
    """A compiled model, read body by body. A link's frame is its body's, moved to its joint."""

    def __init__(self, spec: Any, model: Any, prepared: Prepared, shown: str, root: Node):
        self.spec, self.model, self.prepared, self.shown, self.root = spec, model, prepared, shown, root
        self.notes = prepared.notes
        taken = {model.body(i).name for i in range(model.nbody)}
        self.bodies = [model.body(i).name or _new(f"body_{i}", taken) for i in range(model.nbody)]
        taken = {model.joint(i).name for i in range(model.njnt)}
        self.joints = [model.joint(i).name or _new(f"joint_{i}", taken) for i in range(model.njnt)]
        self.base = self._base()
        self.hinge = [self._joint_of(body) for body in range(model.nbody)]
        self.shift = np.zeros((model.nbody, 3))
        for body, joint in enumerate(self.hinge):
            if joint is not None:
                self.shift[body] = model.jnt_pos[joint]

    def description(self) -> RobotDescription:
        """All of it."""
        model = self.model
        moving = range(1, model.nbody)
        links = [self._link(body) for body in moving]
        joints = [self._joint(body) for body in moving if body != self.base]
        number = self.prepared.numbers["joint_number"]
        joints.sort(key=lambda joint: number.get(joint.name, 0))
        shapes, left_out = read_shapes(self.spec, model, self.bodies, self.shift)
        name = self.spec.modelname
        tools = self._sites() or leaf_end_effectors(links, joints, self.bodies[1:])
        return RobotDescription(
            name=name if self.root.get("model") else Path(self.shown).stem,
            origin=self.shown,
            links=tuple(links),
            joints=tuple(joints),
            end_effectors=tools,
            shapes=tuple(shapes),
            description="a robot from an MJCF file",
            notes="; ".join([*self.notes, *left_out]),
            extra={
                "root_position": model.body_pos[self.base].tolist(),
                "root_quaternion": model.body_quat[self.base].tolist(),
            },
        )

    def _place(self, body: int) -> str:
        return f"{self.shown}: body '{self.bodies[body]}'"

    def _base(self) -> int:
        import mujoco

        model = self.model
        tops = [body for body in range(1, model.nbody) if model.body_parentid[body] == 0]
        if not tops:
            raise InputError(f"{self.shown}: there is no body in <worldbody>")
        if len(tops) > 1:
            raise InputError(
                f"{self.shown}: bodies '{self.bodies[tops[0]]}' and '{self.bodies[tops[1]]}' both stand in "
                "<worldbody>; one, the base, is expected, with the arms in it"
            )
        base = tops[0]
        first = model.body_jntadr[base]
        for joint in range(first, first + model.body_jntnum[base]):
            if model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_FREE:
                raise InputError(
                    f"{self._place(base)}: joint '{self.joints[joint]}' hinges it on the world: the robot has no base "
                    "body; put a body with mass and inertia, its base, between the two (jffsr.attach(..., "
                    "arm_base='drop') then puts the arm on any other)"
                )
        return base

    def _joint_of(self, body: int) -> int | None:
        """The joint that moves a body, None for a fixed one; whatever else is refused."""
        import mujoco

        model = self.model
        count, first = model.body_jntnum[body], model.body_jntadr[body]
        if body in (0, self.base) or not count:
            return None
        names = " and ".join(f"'{self.joints[joint]}'" for joint in range(first, first + count))
        if count > 1:
            raise InputError(
                f"{self._place(body)}: it has {count} joints ({names}); one joint a body is supported: put a body "
                "with its own mass and inertia between them"
            )
        kind = mujoco.mjtJoint(model.jnt_type[first])
        if kind not in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE):
            word = kind.name.removeprefix("mjJNT_").lower()
            raise InputError(
                f"{self._place(body)}: joint {names} is a {word} joint; allowed are hinge and slide, and a free joint "
                "on the base"
            )
        stiffness = np.ravel(model.jnt_stiffness[first])[0]
        if stiffness:
            raise InputError(
                f"{self._place(body)}: joint {names} has a spring (stiffness {stiffness:g}), which is not supported; "
                "set it to 0 to load the robot without it"
            )
        dof = model.jnt_dofadr[first]
        for what in ("damping", "frictionloss", "armature"):
            value = np.ravel(getattr(model, f"dof_{what}")[dof])[0]
            if value:
                self.notes.append(f"joint {names}: {what} {value:g} is left out")
        return int(first)

    def _link(self, body: int) -> LinkDescription:
        model, name = self.model, self.bodies[body]
        mass, moments = float(model.body_mass[body]), model.body_inertia[body]
        if mass == 0 and not moments.any():
            return LinkDescription.frame(name)
        turn = quaternion_to_matrix(model.body_iquat[body])
        inertia = turn @ np.diag(moments) @ turn.T
        inertia = (inertia + inertia.T) / 2
        # A tensor in the text is exact; by way of principal axes it comes back good to 1e-12 only. Where the
        # compiler was told to change inertias the two differ, and what it made holds.
        xx, yy, zz, xy, xz, yz = next(b for b in self.spec.bodies if b.id == body).fullinertia
        stated = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if np.all(np.isfinite(stated)) and np.abs(stated - inertia).max() <= 1e-9 * np.abs(moments).max():
            inertia = stated
        return LinkDescription(name, mass, model.body_ipos[body] - self.shift[body], inertia)

    def _joint(self, body: int) -> JointDescription:
        import mujoco

        model, joint = self.model, self.hinge[body]
        parent = int(model.body_parentid[body])
        rotation = quaternion_to_matrix(model.body_quat[body])
        position = model.body_pos[body] - self.shift[parent] + rotation @ self.shift[body]
        ends = {"parent": self.bodies[parent], "child": self.bodies[body]}
        if joint is None:
            name = f"{self.bodies[body]} (fixed)"
            return JointDescription(
                name, FIXED, **ends, position=position, rotation=rotation, axis=np.array([0, 0, 1.0])
            )
        axis = np.array(model.jnt_axis[joint])
        hinge = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE
        # The file's pose is that at the joint's reference coordinate, ours that at coordinate zero.
        reference = float(model.qpos0[model.jnt_qposadr[joint]])
        if reference and hinge:
            turn = np.concatenate([[np.cos(reference / 2)], -np.sin(reference / 2) * axis])
            rotation = rotation @ quaternion_to_matrix(turn)
        elif reference:
            position = position - rotation @ axis * reference
        name = self.joints[joint]
        low, high = (
            (float(x) for x in model.jnt_range[joint]) if model.jnt_limited[joint] else (-np.inf, np.inf)
        )
        return JointDescription(
            name=name,
            type=REVOLUTE if hinge else PRISMATIC,
            **ends,
            position=position,
            rotation=rotation,
            axis=axis,
            position_limit=(low if low > -UNLIMITED else -np.inf, high if high < UNLIMITED else np.inf),
            velocity_limit=self.prepared.numbers["velocity_limit"].get(name, np.inf),
            acceleration_limit=self.prepared.numbers["acceleration_limit"].get(name, np.inf),
            torque_limit=self._torque(joint),
        )

    def _torque(self, joint: int) -> float:
        if not self.model.jnt_actfrclimited[joint]:
            return np.inf
        low, high = (float(x) for x in self.model.jnt_actfrcrange[joint])
        if low != -high:
            self.notes.append(
                f"joint '{self.joints[joint]}': of the forces [{low:g}, {high:g}] the smaller is the limit"
            )
        limit = min(-low, high)
        return limit if limit < UNLIMITED else np.inf

    def _sites(self) -> tuple[EndEffectorDescription, ...]:
        """Sites in the order of the text; MuJoCo has them in the order of the bodies."""
        model = self.model
        taken = {model.site(i).name for i in range(model.nsite)}
        names = [model.site(i).name or _new(f"site_{i}", taken) for i in range(model.nsite)]
        in_text = [node.get("name") for node in self.root.walk() if node.tag == "site"]
        rank = {name: number for number, name in reversed(list(enumerate(in_text)))}
        order = sorted(range(model.nsite), key=lambda i: (rank.get(model.site(i).name, len(rank)), i))
        found = []
        for site in order:
            body = int(model.site_bodyid[site])
            position = model.site_pos[site] - self.shift[body]
            rotation = quaternion_to_matrix(model.site_quat[site])
            found.append(EndEffectorDescription(names[site], self.bodies[body], position, rotation))
        number = self.prepared.numbers["end_effector_number"]
        return tuple(sorted(found, key=lambda tool: number.get(tool.name, 0)))


def _new(name: str, taken: set[str]) -> str:
    while name in taken:
        name += "_"
    taken.add(name)
    return name
