"""A finished chain looked at again, and its hold made again in MuJoCo."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from jffsr.capture.contact_compound import Compound
from jffsr.errors import InputError
from jffsr.reactionless.estimation.models import KnownLoad
from jffsr.robots.state import State
from jffsr.study.atomic import write_json
from jffsr.study.capture.building import CaptureStudy, build_study
from jffsr.study.chain.carried_out import hold_of, known_load
from jffsr.study.chain.grasping import compound_of
from jffsr.study.chain.running import APPROACH, OBSERVATION, PLAN
from jffsr.study.reactionless.checking import HoldCheck, check_of
from jffsr.study.reviewing import open_result
from jffsr.study.run_folder import RunFolder
from jffsr.target.target_state import TargetState

_STATE = ("base_position", "base_quaternion", "joint_position", "base_twist", "joint_velocity")
_TARGET = ("target_position", "target_velocity", "target_quaternion", "target_angular_velocity")


def open_chain(path: str | Path) -> tuple[RunFolder, CaptureStudy, Any, Any, Any]:
    """The folder and study of a finished chain, and the datasets of its plan, its observation and its motion.

    InputError where something is missing.
    """
    folder = RunFolder(Path(path))
    study = build_study(folder.read_config())
    plan = open_result(folder, folder.path / PLAN, "criterion")
    observation = open_result(folder, folder.path / OBSERVATION, "angular_velocity")
    return folder, study, plan, observation, open_result(folder, folder.result, "time")


def grasp_of(path: str | Path) -> tuple[RunFolder, CaptureStudy, Compound, KnownLoad]:
    """The folder and study of a finished chain, robot and target as one at its grasp, and the load that was grasped.

    Raises InputError for a chain that ended before the hold.
    """
    folder, study, _, _, _ = open_chain(path)
    summary = folder.read_summary()
    if summary["hold"] is None:
        raise InputError(f"{folder.path}: the chain ended before the hold ({summary['result']['sentence']})")
    approached = open_result(folder, folder.path / APPROACH, "target_angular_velocity").isel(time=-1)
    state = State(*(approached[name].to_numpy() for name in _STATE))
    target_state = TargetState(*(approached[name].to_numpy() for name in _TARGET))
    compound = compound_of(study.robot, state, study.target, target_state, study.end_effector)
    return folder, study, compound, known_load(study, state, target_state, compound)


def check_run(path: str | Path) -> HoldCheck:
    """The hold of a finished chain with MuJoCo as the plant, beside ours; the report goes into the run's summary.

    The approach was driven in MuJoCo as the chain ran. Raises InputError for a chain that ended before the hold.
    """
    folder, study, compound, known = grasp_of(path)
    config, summary = folder.read_config(), folder.read_summary()
    both = [hold_of(config, study, compound, known, in_mujoco=where) for where in (True, False)]
    found = check_of([("hold", *both)])
    summary["verification"]["mujoco"] = found.to_dict()
    write_json(folder.summary, summary)
    return found
