"""A joint motion followed in MuJoCo beside a free target, with contacts on: what touches, and where all ends up.

Nothing but motor torques and contact forces acts. Without a touch robot and target part company with ours only by the
rounding and step error of the two integrations; with one the report names the pair, when and how deep.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jffsr.clearance.model import ClearanceModel
from jffsr.clearance.poses import body_poses
from jffsr.crosscheck.beside_target import Contact, follow_beside_target
from jffsr.crosscheck.compare import attitude_difference
from jffsr.crosscheck.contact_model import to_contact_model
from jffsr.crosscheck.drive import check_x64, make_drive
from jffsr.crosscheck.fine_motion import check_momentum, check_positive, fine_motion
from jffsr.crosscheck.mujoco_model import BASE_COORDINATES, rotation_quaternion
from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.rollout import check_duration
from jffsr.trajectories.interface import Trajectory


@dataclass(frozen=True)
class ContactReport:
    """What touched, and how far MuJoCo's poses at the end are from ours.

    contacts in the order of time; tool_position, m, and tool_attitude, rad; target_position, m, and target_attitude,
    rad, None without a target; tracking, rad or m, the largest error of a joint; step, s.
    """

    robot: str
    duration: float
    step: float
    contacts: tuple[Contact, ...]
    tool_position: float
    tool_attitude: float
    target_position: float | None
    target_attitude: float | None
    tracking: float

    @property
    def is_clear(self) -> bool:
        """Whether nothing touched."""
        return not self.contacts


def check_contacts(
    robot: Robot,
    trajectory: Trajectory,
    initial_state: State,
    clearance: ClearanceModel,
    duration: float | None = None,
    momentum: Sequence[float] | None = None,
    *,
    target: Any | None = None,
    target_motion: Any | None = None,
    begin: float = 0.0,
    step: float = 2e-3,
    end_effector: str | None = None,
) -> ContactReport:
    """Drive the joints along the trajectory in MuJoCo, contacts on between the pairs of `clearance`.

    target has mass, inertia and geometry, and target_motion is called with a time, s, and gives its state, as a Target
    and a TargetMotion do; the robot starts at its time `begin`. The rest is as for `crosscheck`. Raises InputError if
    only one of clearance and arguments has a target, for a duration or step that makes no sense, and for a robot that
    MuJoCo refuses.
    """
    check_x64()
    if (target is None) != (target_motion is None):
        raise InputError("check of contacts: target and target_motion belong together; one of them was given")
    clearance.check_target(target is not None)
    duration = check_positive("duration", float(check_duration(trajectory, duration)))
    check_positive("step", step)
    momentum = check_momentum(momentum)
    motion = fine_motion(robot, trajectory, initial_state, duration, momentum)
    drive = make_drive(robot, trajectory, initial_state, np.asarray(motion.time, float), step, momentum)
    model = to_contact_model(robot, clearance, drive.step, target)
    first = None if target is None else target_motion(begin)
    contacts, data, tracking = follow_beside_target(robot, model, drive, first)
    index = robot.end_effector_index(end_effector)
    ours = _tool(robot, index, motion)
    site = data.site(robot.end_effector_names[index])
    place, attitude = site.xpos, rotation_quaternion(site.xmat.reshape(3, 3))
    apart = None, None
    if target is not None:
        end = target_motion(begin + duration)
        pose = data.qpos[BASE_COORDINATES + robot.num_joints :]
        turned = attitude_difference(np.asarray(end.quaternion), pose[3:])
        apart = float(np.linalg.norm(pose[:3] - np.asarray(end.position))), float(turned)
    return ContactReport(
        robot=robot.name,
        duration=duration,
        step=drive.step,
        contacts=contacts,
        tool_position=float(np.linalg.norm(place - ours[0])),
        tool_attitude=float(attitude_difference(ours[1], attitude)),
        target_position=apart[0],
        target_attitude=apart[1],
        tracking=tracking,
    )


def _tool(robot: Robot, index: int, motion: Any) -> tuple[np.ndarray, np.ndarray]:
    """Position (3,), m, and quaternion (4,) of our end effector of this number at the end."""
    last = (motion.base_position, motion.base_quaternion, motion.joint_position)
    origins, rotations = body_poses(np, robot, *(np.asarray(x)[-1:] for x in last))
    body = robot.topology.end_effector_bodies[index]
    rotation = np.squeeze(np.array(rotations[body]), axis=-1)
    place = np.squeeze(np.array(origins[body]), axis=-1) + rotation @ robot.end_effector_position[index]
    return place, rotation_quaternion(rotation @ robot.end_effector_rotation[index])
