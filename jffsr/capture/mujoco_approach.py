"""A capture's approach carried out in MuJoCo by motor torques alone: what robot and target do until the grasp."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jffsr.clearance.model import ClearanceModel
from jffsr.crosscheck.beside_target import Contact, follow_beside_target
from jffsr.crosscheck.contact_model import to_contact_model
from jffsr.crosscheck.drive import Drive, check_x64, make_drive
from jffsr.crosscheck.fine_motion import check_momentum, check_positive
from jffsr.crosscheck.mujoco_model import BASE_COORDINATES, BASE_VELOCITIES
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.target.target_state import TargetState
from jffsr.trajectories.interface import Trajectory


@dataclass(frozen=True)
class Approach:
    """What MuJoCo made of a joint motion beside a free target, on K + 1 samples (host arrays).

    time (K + 1,), s, since the robot started; states and target_states, State and TargetState with leading axes
    (K + 1,), in I but for the target's angular velocity, in T; joint_torque (K, n), N m or N, at the samples but the
    last; tracking, rad or m, the largest error of a joint; contacts, what touched before the end.
    """

    time: np.ndarray
    states: State
    target_states: TargetState
    joint_torque: np.ndarray
    tracking: float
    contacts: tuple[Contact, ...]

    @property
    def end(self) -> tuple[State, TargetState]:
        """Robot and target at the last sample."""
        last = {name: np.asarray(value)[-1] for name, value in vars(self.states).items()}
        target = {name: np.asarray(value)[-1] for name, value in vars(self.target_states).items()}
        return State(**last), TargetState(**target)


def approach(
    robot: Robot,
    trajectory: Trajectory,
    initial_state: State,
    clearance: ClearanceModel,
    target: Any,
    target_state: TargetState,
    duration: float,
    momentum: Sequence[float] | None = None,
    *,
    samples: int = 200,
    step: float = 2e-3,
) -> Approach:
    """Drive the joints along the trajectory in MuJoCo, the target free beside them, contacts on between the pairs of
    `clearance`.

    target has mass, inertia and geometry, as for `check_contacts`, target_state is its true state when the robot
    starts; samples intervals are recorded. Raises InputError as `check_contacts` does.
    """
    check_x64()
    clearance.check_target(True)
    duration = check_positive("duration", float(duration))
    check_positive("step", step)
    momentum = check_momentum(momentum)
    drive = make_drive(
        robot, trajectory, initial_state, np.linspace(0.0, duration, samples + 1), step, momentum
    )
    model = to_contact_model(robot, clearance, drive.step, target)
    position, velocity, torque = [], [], []

    def watch(number: int, data: Any) -> None:
        if number % drive.substeps == 0:
            position.append(data.qpos.copy())
            velocity.append(data.qvel.copy())
            torque.append(data.ctrl.copy())

    contacts, _, tracking = follow_beside_target(robot, model, drive, target_state, watch)
    states, targets = _states(drive, np.array(position), np.array(velocity), robot.num_joints)
    torques = drive.robot_order(np.array(torque[:-1]))
    return Approach(drive.time, states, targets, torques, tracking, contacts)


def _states(drive: Drive, position: np.ndarray, velocity: np.ndarray, n: int) -> tuple[State, TargetState]:
    """Ours, of MuJoCo's coordinates: a free joint's linear velocity is resolved in I, its angular one in the body."""
    end = BASE_COORDINATES + n
    own, other = position[:, :end], position[:, end:]
    rate, other_rate = velocity[:, : BASE_VELOCITIES + n], velocity[:, BASE_VELOCITIES + n :]
    quaternion = own[:, 3:BASE_COORDINATES]
    spin = _turned(quaternion, rate[:, 3:BASE_VELOCITIES])
    states = State(
        base_position=own[:, :3],
        base_quaternion=quaternion,
        joint_position=drive.robot_order(own[:, BASE_COORDINATES:]),
        base_twist=np.concatenate([rate[:, :3], spin], axis=1),
        joint_velocity=drive.robot_order(rate[:, BASE_VELOCITIES:]),
    )
    targets = TargetState(
        position=other[:, :3],
        velocity=other_rate[:, :3],
        quaternion=other[:, 3:],
        angular_velocity_T=other_rate[:, 3:],
    )
    return states, targets


def _turned(quaternion: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Vectors (K, 3) of frames with these quaternions (K, 4), w first, in the frame that the quaternions lead to."""
    w, axis = quaternion[:, :1], quaternion[:, 1:]
    across = np.cross(axis, vector)
    return vector + 2 * (w * across + np.cross(axis, across))
