"""Joint rates held from sample to sample, in MuJoCo: driven by torques, and by the conservation of momentum alone.

Rates that jump take an impulse of the motors. No external wrench acts, so an impulse that changes the joints' rates by
d changes the base's velocity by -M_bb^-1 M_bm d. Between the impulses the motors hold the rates by finite torques.
The second way uses no equation of motion: MuJoCo's inertia matrix gives the base's velocity at the momentum and the
rates, and SciPy integrates it with steps of its own choice.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from jffsr.crosscheck.drive import body_momenta, commanded_acceleration, joint_torque, largest_shares
from jffsr.crosscheck.mujoco_model import BASE_COORDINATES, BASE_VELOCITIES, branch_order, to_mjmodel
from jffsr.robots.robot import Robot

# Tolerances of the adaptive integration: far below every difference that is asked for, above its rounding.
_RELATIVE, _ABSOLUTE = 1e-11, 1e-12


@dataclass(frozen=True)
class HeldJoints:
    """A joint motion of constant rates between K + 1 samples, from a pose, under a momentum (host arrays).

    time (K + 1,), s; joint_position (K + 1, n) and joint_rate (K, n) in the robot's order; base_position (3,), m,
    base_quaternion (4,), B to I, at the start; momentum (6,), P and L about the system centre of mass.
    """

    time: np.ndarray
    joint_position: np.ndarray
    joint_rate: np.ndarray
    base_position: np.ndarray
    base_quaternion: np.ndarray
    momentum: np.ndarray


@dataclass(frozen=True)
class HeldMotion:
    """The motion as MuJoCo made it, at the K + 1 samples (host arrays).

    base_position and tool_position (K + 1, 3), m; base_quaternion and tool_quaternion (K + 1, 4) in I;
    joint_position (K + 1, n); momentum (K + 1, 6) from MuJoCo's velocities; momentum_share (2,), the largest of
    any one body, linear and angular; tracking_error, rad or m, over all steps and joints; seconds.
    """

    base_position: np.ndarray
    base_quaternion: np.ndarray
    joint_position: np.ndarray
    tool_position: np.ndarray
    tool_quaternion: np.ndarray
    momentum: np.ndarray
    momentum_share: np.ndarray
    tracking_error: float
    seconds: float


def drive_held_rates(
    robot: Robot, held: HeldJoints, largest_step: float, end_effector: str | None = None
) -> HeldMotion:
    """The motion by torques and impulses of the joints' motors, in equal steps of at most `largest_step`, s."""
    started = time.perf_counter()
    order = branch_order(robot.topology)
    rates, wanted_position = held.joint_rate[:, order], held.joint_position[:, order]
    interval = float(held.time[1] - held.time[0])
    # Without the margin, rounding of the interval would add a step to an exact division.
    substeps = max(1, int(np.ceil(interval / largest_step * (1 - 1e-9))))
    engine = _Engine(robot, interval / substeps, end_effector)
    engine.start(held, wanted_position[0])
    engine.data.qvel[:] = engine.velocity(held.momentum, rates[0])
    record, error = _Record(engine), 0.0
    for k, rate in enumerate(rates):
        engine.update()
        record.add()
        engine.strike(rate)
        for i in range(substeps):
            reference = wanted_position[k] + i * (interval / substeps) * rate
            error = np.maximum(error, engine.step(reference, rate))
    engine.update()
    record.add()
    last = np.abs(wanted_position[-1] - engine.data.qpos[BASE_COORDINATES:]).max()
    return record.motion(order, float(np.maximum(error, last)), time.perf_counter() - started)


def integrate_momentum(robot: Robot, held: HeldJoints, end_effector: str | None = None) -> HeldMotion:
    """The motion by the momentum equation with MuJoCo's inertia matrix, integrated adaptively (DOP853)."""
    started = time.perf_counter()
    order = branch_order(robot.topology)
    rates, position = held.joint_rate[:, order], held.joint_position[:, order]
    interval = float(held.time[1] - held.time[0])
    engine = _Engine(robot, interval, end_effector)
    engine.start(held, position[0])
    record, error = _Record(engine), 0.0

    def settle(pose: np.ndarray, joints: np.ndarray, rate: np.ndarray) -> np.ndarray:
        engine.data.qpos[:BASE_COORDINATES], engine.data.qpos[BASE_COORDINATES:] = pose, joints
        engine.data.qpos[3:BASE_COORDINATES] /= np.linalg.norm(pose[3:])
        engine.update()
        engine.data.qvel[:] = engine.velocity(held.momentum, rate)
        return engine.data.qvel

    def slope(t: float, pose: np.ndarray, joints: np.ndarray, rate: np.ndarray) -> np.ndarray:
        velocity = settle(pose, joints + t * rate, rate)
        w, v, spin = pose[3], pose[4:], velocity[3:BASE_VELOCITIES]
        turning = 0.5 * np.concatenate([[-(v @ spin)], w * spin + np.cross(v, spin)])
        return np.concatenate([velocity[:3], turning])

    pose, joints = engine.data.qpos[:BASE_COORDINATES].copy(), position[0].copy()
    for k, rate in enumerate(rates):
        settle(pose, joints, rate)
        record.add()
        found = solve_ivp(
            slope,
            (0.0, interval),
            pose,
            method="DOP853",
            args=(joints, rate),
            rtol=_RELATIVE,
            atol=_ABSOLUTE,
        )
        pose, joints = found.y[:, -1], joints + interval * rate
        pose[3:] /= np.linalg.norm(pose[3:])
        error = np.maximum(error, np.abs(position[k + 1] - joints).max())
    settle(pose, joints, rates[-1])
    record.add()
    return record.motion(order, float(error), time.perf_counter() - started)


class _Engine:
    """A MuJoCo model with its data, inertia matrix and tool."""

    def __init__(self, robot: Robot, step: float, end_effector: str | None) -> None:
        import mujoco

        self.mujoco, self.length = mujoco, step
        self.model = to_mjmodel(robot, step)
        self.data = mujoco.MjData(self.model)
        self.inertia = np.zeros((self.model.nv, self.model.nv))
        name = robot.topology.end_effector_names[robot.end_effector_index(end_effector)]
        self.site = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_SITE, name)

    def start(self, held: HeldJoints, joints: np.ndarray) -> None:
        self.data.qpos[:] = np.concatenate([held.base_position, held.base_quaternion, joints])
        self.update()

    def update(self) -> None:
        """Everything that positions and velocities decide."""
        self.mujoco.mj_fwdPosition(self.model, self.data)
        self.mujoco.mj_fwdVelocity(self.model, self.data)
        self.mujoco.mj_fullM(self.model, self.data, self.inertia)

    def velocity(self, momentum: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Velocity (6 + n,) of a system with this momentum (6,) at these joint rates (n,)."""
        data, b = self.data, BASE_VELOCITIES
        lever = data.subtree_com[1] - data.qpos[:3]
        about_base = momentum[3:] + np.cross(lever, momentum[:3])
        # The free joint's momentum: linear in I, angular in B.
        carried = np.concatenate([momentum[:3], data.xmat[1].reshape(3, 3).T @ about_base])
        base = np.linalg.solve(self.inertia[:b, :b], carried - self.inertia[:b, b:] @ rate)
        return np.concatenate([base, rate])

    def strike(self, rate: np.ndarray) -> None:
        """An impulse of the motors that gives the joints these rates (n,), the base answering."""
        data, b = self.data, BASE_VELOCITIES
        jump = rate - data.qvel[b:]
        data.qvel[:b] -= np.linalg.solve(self.inertia[:b, :b], self.inertia[:b, b:] @ jump)
        data.qvel[b:] = rate

    def step(self, position: np.ndarray, rate: np.ndarray) -> float:
        """One step under torques towards these positions and rates (n,); how far the joints were off at its start."""
        self.update()
        data, off = self.data, position - self.data.qpos[BASE_COORDINATES:]
        wanted = commanded_acceleration(
            self.length, np.zeros_like(rate), off, rate - data.qvel[BASE_VELOCITIES:]
        )
        data.ctrl[:] = joint_torque(np, self.inertia, data.qfrc_bias, wanted)
        # Positions and velocities are done: mj_step would do them again before it integrates.
        self.mujoco.mj_forwardSkip(self.model, data, self.mujoco.mjtStage.mjSTAGE_VEL, 1)
        self.mujoco.mj_RungeKutta(self.model, data, 4)
        return float(np.abs(off).max())


class _Record:
    """What is kept of each sample."""

    def __init__(self, engine: _Engine) -> None:
        self.engine, self.poses, self.tools = engine, [], []
        self.momenta: list[np.ndarray] = []
        self.states: list[list[Any]] = []

    def add(self) -> None:
        """The state as it is."""
        e, data = self.engine, self.engine.data
        e.mujoco.mj_fwdVelocity(e.model, data)
        e.mujoco.mj_subtreeVel(e.model, data)
        linear = e.model.body_subtreemass[1] * data.subtree_linvel[1]
        self.momenta.append(np.concatenate([linear, data.subtree_angmom[1]]))
        self.poses.append(data.qpos.copy())
        quaternion = np.zeros(4)
        e.mujoco.mju_mat2Quat(quaternion, data.site_xmat[e.site])
        self.tools.append((data.site_xpos[e.site].copy(), quaternion))
        read = data.xipos[1:], data.ximat[1:], data.cvel[1:], data.subtree_com[1]
        self.states.append([x.copy() for x in read])

    def motion(self, order: np.ndarray, tracking_error: float, seconds: float) -> HeldMotion:
        """All samples together."""
        poses, model = np.array(self.poses), self.engine.model
        com, axes, velocity, system_com = (np.array(x) for x in zip(*self.states, strict=True))
        bodies = model.body_mass[1:], model.body_inertia[1:]
        momenta = body_momenta(*bodies, com, axes.reshape(*axes.shape[:2], 3, 3), velocity, system_com)
        tool_position, tool_quaternion = (np.array(x) for x in zip(*self.tools, strict=True))
        return HeldMotion(
            base_position=poses[:, :3],
            base_quaternion=poses[:, 3:BASE_COORDINATES],
            joint_position=poses[:, BASE_COORDINATES:][:, np.argsort(order)],
            tool_position=tool_position,
            tool_quaternion=tool_quaternion,
            momentum=np.array(self.momenta),
            momentum_share=largest_shares(*momenta),
            tracking_error=tracking_error,
            seconds=seconds,
        )
