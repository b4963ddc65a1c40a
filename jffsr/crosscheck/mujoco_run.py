"""A joint motion followed in MuJoCo, stage by stage with MuJoCo's own functions."""

from __future__ import annotations

import time

import numpy as np

from jffsr.crosscheck.drive import (
    Drive,
    EngineMotion,
    body_momenta,
    commanded_acceleration,
    joint_torque,
    largest_shares,
)
from jffsr.crosscheck.mujoco_model import BASE_COORDINATES, BASE_VELOCITIES, to_mjmodel
from jffsr.robots.robot import Robot


def run_mujoco(robot: Robot, drive: Drive) -> EngineMotion:
    """The motion in MuJoCo; after t = 0 only the motors' torques are written."""
    import mujoco

    model = to_mjmodel(robot, drive.step)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = drive.qpos, drive.qvel
    inertia = np.zeros((model.nv, model.nv))
    poses, momenta, states, error = [], [], [], 0.0

    def sample() -> None:
        mujoco.mj_subtreeVel(model, data)
        linear = model.body_subtreemass[1] * data.subtree_linvel[1]
        momenta.append(np.concatenate([linear, data.subtree_angmom[1]]))
        poses.append(data.qpos.copy())
        read = data.xipos[1:], data.ximat[1:], data.cvel[1:], data.subtree_com[1]
        states.append([x.copy() for x in read])

    start = time.perf_counter()
    total = len(drive.mean_acceleration)
    for k in range(total + 1):
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        position_error = drive.joint_position[k] - data.qpos[BASE_COORDINATES:]
        # Written so that a NaN stays.
        error = np.maximum(error, np.abs(position_error).max())
        if k % drive.substeps == 0:
            sample()
        if k == total:
            break
        rate_error = drive.joint_velocity[k] - data.qvel[BASE_VELOCITIES:]
        wanted = commanded_acceleration(drive.step, drive.mean_acceleration[k], position_error, rate_error)
        mujoco.mj_fullM(model, data, inertia)
        data.ctrl[:] = joint_torque(np, inertia, data.qfrc_bias, wanted)
        # Positions and velocities are done: mj_step would do them again before it integrates.
        mujoco.mj_forwardSkip(model, data, mujoco.mjtStage.mjSTAGE_VEL, 1)
        mujoco.mj_RungeKutta(model, data, 4)
    seconds = time.perf_counter() - start

    poses = np.array(poses)
    com, axes, velocity, system_com = (np.array(x) for x in zip(*states, strict=True))
    axes = axes.reshape(*axes.shape[:2], 3, 3)
    bodies = model.body_mass[1:], model.body_inertia[1:]
    return EngineMotion(
        time=drive.time,
        base_position=poses[:, :3],
        base_quaternion=poses[:, 3:BASE_COORDINATES],
        joint_position=drive.robot_order(poses[:, BASE_COORDINATES:]),
        momentum=np.array(momenta),
        momentum_share=largest_shares(*body_momenta(*bodies, com, axes, velocity, system_com)),
        tracking_error=float(error),
        compile_seconds=0.0,
        run_seconds=seconds,
    )
