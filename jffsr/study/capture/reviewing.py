"""A finished capture run looked at again, and driven again in MuJoCo with contacts on."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.problem import capture_problem
from jffsr.crosscheck.contacts import ContactReport, check_contacts
from jffsr.dynamics.base_mode import FLOATING
from jffsr.errors import InputError
from jffsr.study.atomic import write_json
from jffsr.study.capture.building import CaptureStudy, build_settings, build_study, clearance_model
from jffsr.study.capture.running import FRONT
from jffsr.study.capture.schema import CaptureConfig
from jffsr.study.capture.schema_planner import FREE
from jffsr.study.reviewing import open_result
from jffsr.study.run_folder import RunFolder
from jffsr.trajectories.bspline import ClampedBSpline

_FAR = 1e-4
"""m and rad, as in the cross-check of plans."""
_TRACKING = 1e-6


def open_capture(path: str | Path) -> tuple[RunFolder, CaptureStudy, Any, dict[str, Any]]:
    """The folder, study and dataset of a finished capture run, and the datasets of the front's chosen solutions.

    InputError where something is missing.
    """
    folder = RunFolder(Path(path))
    study = build_study(folder.read_config())
    dataset = open_result(folder, folder.result, "criterion")
    front = folder.read_summary().get("front") or {"chosen": {}}
    solutions = {
        name: open_result(folder, folder.path / FRONT / f"{name}.nc", "free_numbers")
        for name in front["chosen"]
    }
    return folder, study, dataset, solutions


@dataclass(frozen=True)
class CaptureCheck:
    """What MuJoCo says of a capture: what touched, how far its tool and target end from ours and from each other."""

    report: ContactReport

    @property
    def passed(self) -> bool:
        """Whether nothing touched, and tool and target end where they should."""
        return not self.failures()

    def failures(self) -> list[str]:
        """A phrase for everything that is not as it should be; NaN is not."""
        report = self.report
        wrong = [str(contact) for contact in report.contacts]
        for what, value, allowed, unit in (
            ("the tool ends off by", report.tool_position, _FAR, "m"),
            ("the tool's attitude is off by", report.tool_attitude, _FAR, "rad"),
            ("the target ends off by", report.target_position, _FAR, "m"),
            ("the target's attitude is off by", report.target_attitude, _FAR, "rad"),
            ("joint tracking misses by", report.tracking, _TRACKING, "rad or m"),
        ):
            if value is not None and not value <= allowed:
                wrong.append(f"{what} {value:.2g} {unit} ({allowed:g} allowed)")
        return wrong

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        report, wrong = self.report, self.failures()
        if wrong:
            return f"The capture failed in MuJoCo: {'; '.join(wrong)}."
        far, turned = report.tool_position, report.tool_attitude
        return (
            "MuJoCo, with contacts on, reproduces the capture: nothing touched, and the tool ends within "
            f"{far:.2g} m and {turned:.2g} rad."
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, lists and text, ready for JSON."""
        return {**asdict(self.report), "passed": self.passed, "sentence": self.sentence}

    def to_text(self) -> str:
        """The numbers in lines, and the sentence below them."""
        report = self.report
        lines = [f"  step          {1e3 * report.step:.4g} ms over {report.duration:.4g} s"]
        lines.append(
            f"  tool          {report.tool_position:.2e} m, {report.tool_attitude:.2e} rad from ours"
        )
        if report.target_position is not None:
            lines.append(
                f"  target        {report.target_position:.2e} m, {report.target_attitude:.2e} rad from ours"
            )
        lines += [f"  contact       {contact}" for contact in report.contacts]
        return "\n".join([*lines, self.sentence])


def check_run(path: str | Path) -> CaptureCheck:
    """The plan driven again in MuJoCo beside the true target, contacts on; the report goes into the run's summary.

    Raises InputError for a run without a plan, and for a base that is not free.
    """
    folder, study, dataset, _ = open_capture(path)
    config, summary = folder.read_config(), folder.read_summary()
    if "free_numbers" not in dataset:
        raise InputError(f"{folder.path}: the run found no plan ({summary['result']['sentence']})")
    if study.base_mode != FLOATING:
        raise InputError(
            f"{folder.config}: task.base_mode is '{study.base_mode}'; only floating bases are driven in MuJoCo"
        )
    free = dataset["free_numbers"].to_numpy()
    duration = float(dataset["time"].to_numpy()[-1])
    law = joint_law(config, study, duration)
    if free.shape != np.shape(law.free_bounds()[0]):
        raise InputError(f"{folder.result}: holds no plan of {folder.config} (free numbers {free.shape})")
    model = clearance_model(config, study, study.geometry)
    beside = {"target": replace(study.target, geometry=study.geometry), "target_motion": study.motion}
    report = check_contacts(
        study.robot,
        law.with_free(free),
        study.initial_state,
        model,
        duration,
        momentum=study.momentum,
        end_effector=study.end_effector,
        **(beside if model.has_target else {}),
    )
    found = CaptureCheck(report)
    summary["verification"]["mujoco"] = found.to_dict()
    write_json(folder.summary, summary)
    return found


def joint_law(config: CaptureConfig, study: CaptureStudy, duration: float) -> ClampedBSpline:
    """The joint law of the plans of a study; its duration counts where the grasp time was not free."""
    time = None if config.grasp_time.time == FREE else duration
    settings = build_settings(config, time)
    path = GraspPath.create(study.motion, study.target.grasp_names[0])
    problem = capture_problem(
        study.robot,
        path,
        study.initial_state,
        duration,
        duration_bounds=settings.candidates.window if settings.free_time else None,
        control_points=settings.control_points,
        num_steps=settings.num_steps,
        end_effector=study.end_effector,
    )
    return problem.trajectory
