"""The replays of a capture and of a chain: the robot beside its target, which it carries from the grasp on."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from jffsr.study.capture.building import CaptureStudy
from jffsr.study.capture.reviewing import open_capture
from jffsr.study.chain.reviewing import open_chain
from jffsr.study.chain.running import APPROACH
from jffsr.study.reviewing import open_result
from jffsr.viz.replay.curves import base_rate, run_name, torques
from jffsr.viz.replay.of_robot import Extras, robot_replay
from jffsr.viz.replay.of_target import capture_extras, target_solids
from jffsr.viz.replay.replay import NothingMoved, Replay
from jffsr.viz.scene import scene_of

if TYPE_CHECKING:
    from xarray import Dataset


def captured_replays(path: Path) -> list[Replay]:
    """The motion to the grasp; NothingMoved where no plan was found."""
    folder, study, dataset, _ = open_capture(path)
    if "joint_position" not in dataset:
        raise NothingMoved(f"{folder.path}: the run found no plan, so that nothing moves in it")
    return [robot_replay(run_name(folder), study.robot, dataset, capture_extras(study.geometry, dataset))]


def chained_replays(path: Path) -> list[Replay]:
    """The approach and the hold after it; NothingMoved for a chain that ended before anything moved."""
    folder, study, _, _, dataset = open_chain(path)
    if "joint_position" not in dataset or dataset.sizes["time"] < 2:
        raise NothingMoved(f"{folder.path}: the chain ended before anything moved")
    # Samples in which the hold begins where the approach ended are the same instant twice.
    time = dataset["time"].values
    dataset = dataset.isel(time=np.flatnonzero(np.concatenate([[True], np.diff(time) > 0])))
    approached = open_result(folder, folder.path / APPROACH, "target_position")
    extras = Extras(panels=(base_rate(dataset), torques(dataset)))
    stage, time = dataset["stage"].values, dataset["time"].values
    if np.any(stage == 1):
        extras.marks = (("grasp", float(time[stage == 0][-1])),)
    position, quaternion = _carried_target(study, dataset, approached)
    extras.solids = target_solids(study.geometry, position, quaternion)
    return [robot_replay(run_name(folder), study.robot, dataset, extras)]


def _carried_target(
    study: CaptureStudy, dataset: Dataset, approached: Dataset
) -> tuple[np.ndarray, np.ndarray]:
    """The target's pose at every sample of a chain: as MuJoCo moved it, and fixed in the tool from the grasp on."""
    held = np.flatnonzero(dataset["stage"].values == 1)
    free = len(dataset["time"]) - len(held)
    nearest = approached.sel(time=dataset["time"].values[:free], method="nearest")
    position, quaternion = nearest["target_position"].values, nearest["target_quaternion"].values
    if not len(held):
        return position, quaternion
    tool = study.robot.end_effector_names.index(study.end_effector)
    scene = scene_of(study.robot, dataset.isel(time=[free - 1, *held]))
    place, turn = scene.tools[:, tool], scene.tool_rotation[:, tool]
    offset = turn[0].T @ (position[-1] - place[0])
    relative = turn[0].T @ Rotation.from_quat(quaternion[-1], scalar_first=True).as_matrix()
    turned = Rotation.from_matrix(turn[1:] @ relative).as_quat(scalar_first=True)
    return np.concatenate([position, place[1:] + turn[1:] @ offset]), np.concatenate([quaternion, turned])
