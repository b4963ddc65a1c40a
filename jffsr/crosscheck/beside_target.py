"""Motor torques that make a joint motion in MuJoCo, beside a free target with contacts on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from jffsr.clearance.pairs import TARGET
from jffsr.crosscheck.drive import Drive, commanded_acceleration, joint_torque
from jffsr.crosscheck.mujoco_model import BASE_COORDINATES, BASE_VELOCITIES, body_name
from jffsr.robots.robot import Robot


@dataclass(frozen=True)
class Contact:
    """Two bodies that touched: `pair`, the time of the first touch, s, and the deepest overlap, m."""

    pair: tuple[str, str]
    time: float
    depth: float

    def __str__(self) -> str:
        return f"{' and '.join(self.pair)} touch at {self.time:.4g} s, {self.depth:.3g} m deep"


def follow_beside_target(
    robot: Robot,
    model: Any,
    drive: Drive,
    first: Any | None,
    watch: Callable[[int, Any], None] = lambda step, data: None,
) -> tuple[tuple[Contact, ...], Any, float]:
    """Follow the drive in a model of `to_contact_model`, the target, if any, beginning in the state `first`.

    watch is called with the number of each step that begins, the end's too, and MuJoCo's data, up to date then.
    Gives what touched, in the order of time, the data at the end, and the largest error of a joint, rad or m.
    """
    import mujoco

    data = mujoco.MjData(model)
    pose, rate = [drive.qpos], [drive.qvel]
    if first is not None:
        pose += [np.asarray(first.position), np.asarray(first.quaternion)]
        rate += [np.asarray(first.velocity), np.asarray(first.angular_velocity_T)]
    data.qpos[:], data.qvel[:] = np.concatenate(pose), np.concatenate(rate)
    n, joints = robot.num_joints, slice(BASE_COORDINATES, BASE_COORDINATES + robot.num_joints)
    own = slice(0, BASE_VELOCITIES + n)
    inertia = np.zeros((model.nv, model.nv))
    names = {model.body(body_name(name)).id: name for name in robot.body_names}
    if first is not None:
        names[model.body(TARGET).id] = TARGET
    touched: dict[tuple[str, str], tuple[float, float]] = {}
    error, total = 0.0, len(drive.mean_acceleration)
    for k in range(total + 1):
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        for contact in data.contact[: data.ncon]:
            pair = tuple(names[b] for b in sorted(model.geom_bodyid[contact.geom]))
            if contact.dist <= 0:
                time, depth = touched.get(pair, (k * drive.step, 0.0))
                touched[pair] = time, max(depth, -contact.dist)
        position_error = drive.joint_position[k] - data.qpos[joints]
        error = np.maximum(error, np.abs(position_error).max())
        if k == total:
            watch(k, data)
            break
        rate_error = drive.joint_velocity[k] - data.qvel[BASE_VELOCITIES : own.stop]
        wanted = commanded_acceleration(drive.step, drive.mean_acceleration[k], position_error, rate_error)
        mujoco.mj_fullM(model, data, inertia)
        data.ctrl[:] = joint_torque(np, inertia[own, own], data.qfrc_bias[own], wanted)
        watch(k, data)
        mujoco.mj_forwardSkip(model, data, mujoco.mjtStage.mjSTAGE_VEL, 1)
        mujoco.mj_RungeKutta(model, data, 4)
    contacts = [Contact(pair, float(time), float(depth)) for pair, (time, depth) in touched.items()]
    return tuple(sorted(contacts, key=lambda contact: contact.time)), data, float(error)
