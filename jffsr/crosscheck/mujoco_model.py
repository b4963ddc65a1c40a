"""The robot as a MuJoCo model: rigid bodies, a free base, a motor at every joint, and nothing else."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from jffsr.errors import InputError
from jffsr.robots.principal import principal_axes
from jffsr.robots.robot import REVOLUTE, Robot, Topology

if TYPE_CHECKING:
    import mujoco

BASE_COORDINATES = 7
"""Coordinates of the free joint: position, then quaternion (w, x, y, z)."""
BASE_VELOCITIES = 6
"""Velocities of the free joint: linear in I, then angular in B."""

# Nothing but inertia and motor torque may act; joint limits of the robot are the planner's business.
_DISABLED = (
    "CONSTRAINT", "EQUALITY", "FRICTIONLOSS", "LIMIT", "CONTACT", "SPRING", "DAMPER", "GRAVITY",
    "CLAMPCTRL", "WARMSTART", "SENSOR", "EULERDAMP", "AUTORESET",
)  # fmt: skip


def to_mjspec(robot: Robot) -> mujoco.MjSpec:
    """MuJoCo specification of a robot: body 1 is the base, bodies, joints and motors in `branch_order`.

    Body frames are ours, so the free joint carries the base's centre of mass and MuJoCo's joint coordinates
    equal ours, but for their order. Gravity, contacts, damping, armature and limits are absent; each joint
    has a motor of gear one, which is the only thing that can act; end effectors are sites. The integrator is
    RK4.
    """
    import mujoco

    spec = mujoco.MjSpec()
    spec.modelname = robot.name
    spec.compiler.degree = False
    spec.compiler.fusestatic = False
    spec.option.gravity = np.zeros(3)
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    for name in _DISABLED:
        spec.option.disableflags |= int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{name}"))

    topology = robot.topology
    base = spec.worldbody.add_body(name=body_name(topology.body_names[0]))
    base.add_freejoint()
    _set_inertia(base, robot, 0)
    bodies = [base]
    for i, parent in enumerate(topology.parents):
        body = bodies[parent].add_body(
            name=body_name(topology.body_names[i + 1]),
            pos=np.asarray(robot.joint_position[i], dtype=float),
            quat=rotation_quaternion(robot.joint_rotation[i]),
        )
        hinge, slide = mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE
        body.add_joint(
            name=topology.joint_names[i],
            type=hinge if topology.joint_types[i] == REVOLUTE else slide,
            axis=np.asarray(robot.joint_axis[i], dtype=float),
        )
        _set_inertia(body, robot, i + 1)
        bodies.append(body)
    for i in branch_order(topology):
        motor = spec.add_actuator(name=topology.joint_names[i], target=topology.joint_names[i])
        motor.trntype = mujoco.mjtTrn.mjTRN_JOINT
        motor.set_to_motor()
    for k, name in enumerate(topology.end_effector_names):
        bodies[topology.end_effector_bodies[k]].add_site(
            name=name,
            pos=np.asarray(robot.end_effector_position[k], dtype=float),
            quat=rotation_quaternion(robot.end_effector_rotation[k]),
        )
    return spec


def branch_order(topology: Topology) -> np.ndarray:
    """Our joint (n,) at each of MuJoCo's coordinates, which run along a branch to its end before the next."""
    order: list[int] = []

    def follow(body: int) -> None:
        for joint, parent in enumerate(topology.parents):
            if parent == body:
                order.append(joint)
                follow(joint + 1)

    follow(0)
    return np.array(order, dtype=int)


def to_mjmodel(robot: Robot, step: float) -> mujoco.MjModel:
    """The compiled model with this time step, s; InputError where MuJoCo refuses the robot."""
    spec = to_mjspec(robot)
    spec.option.timestep = step
    try:
        return spec.compile()
    except ValueError as error:
        reason = " ".join(str(error).split())
        raise InputError(f"MuJoCo does not accept the robot '{robot.name}': {reason}") from error


def body_name(name: str) -> str:
    """The name that a body of ours has in MuJoCo."""
    # MuJoCo keeps this name for the inertial frame.
    return "world_body" if name == "world" else name


def rotation_quaternion(rotation) -> np.ndarray:
    """Unit quaternion (4,), (w, x, y, z), of a rotation matrix (3, 3), by MuJoCo."""
    import mujoco

    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(rotation, dtype=float).ravel())
    return quaternion


def _set_inertia(body, robot: Robot, index: int) -> None:
    moments, axes = principal_axes(robot.inertia[index])
    body.explicitinertial = True
    body.mass = float(robot.mass[index])
    body.ipos = np.zeros(3) if index == 0 else np.asarray(robot.link_com[index - 1], dtype=float)
    body.iquat = rotation_quaternion(axes)
    body.inertia = moments
