"""One capture study carried out: the target observed or known, the grasp frame and its time, the plan, the front."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import jax
import numpy as np

from jffsr.capture.captures import CaptureTask, different_captures
from jffsr.capture.front import CaptureFront, capture_front
from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.grasp_time import GraspTime, GraspTimeCode, grasp_time
from jffsr.capture.match import grasp_error
from jffsr.capture.outcome import CaptureCode, CaptureResult, explain_capture
from jffsr.capture.plan import CapturePlan, plan_capture
from jffsr.compiling import program
from jffsr.study.capture.building import (
    CaptureStudy,
    build_clearance,
    build_indices,
    build_settings,
    build_terms,
    fixed_time,
)
from jffsr.study.capture.observing import ObservedTarget, observe
from jffsr.study.capture.schema import CaptureConfig
from jffsr.study.capture.schema_planner import CRITERION
from jffsr.target.grasp_frames import grasp_frame
from jffsr.target.prediction import GraspPrediction, prediction_error

_OF_TIME = {GraspTimeCode.NEVER_FACING: CaptureCode.NEVER_FACING}


@dataclass(frozen=True)
class PlannedCapture:
    """What a study found: result; chosen, when to grasp, in the time of the planned-for motion, which is `age` s ahead
    of the robot's; grasp, the frame's name; plan and front, None where there is none.

    Of an observed target also predictions, and errors (12,) of a plan's end to the true grasp frame.
    """

    result: CaptureResult
    chosen: GraspTime
    grasp: str
    age: float
    path: GraspPath | None = None
    true_path: GraspPath | None = None
    observed: ObservedTarget | None = None
    prediction: GraspPrediction | None = None
    prediction_error: np.ndarray | None = None
    true_error: np.ndarray | None = None
    plan: CapturePlan | None = None
    front: CaptureFront | None = None

    @property
    def time(self) -> float | None:
        """The criterion's time, s after the robot starts."""
        return None if self.chosen.time is None else self.chosen.time - self.age


def plan_study(
    config: CaptureConfig, study: CaptureStudy, say: Callable[[str], None] = lambda text: None
) -> PlannedCapture:
    """Carry the study out; what cannot be done is told by the result's code."""
    observed, motion, geometry, age = None, study.motion, study.geometry, 0.0
    if config.observation is not None:
        observed = observe(study, config.observation, float(study.motion.duration))
        motion, geometry, age = observed.motion, observed.geometry, observed.age
        say(f"observed {observed.seen} poses")
    first, last = config.grasp_time.window
    chosen = grasp_time(
        study.robot,
        motion,
        study.initial_state,
        study.capability,
        grasps=config.grasps,
        window=(age + first, age + last),
        least_share=config.grasp_time.least_share,
        confirm=config.grasp_time.time == CRITERION and config.grasp_time.confirm,
        momentum=study.momentum if np.any(study.momentum) else None,
        base_mode=study.base_mode,
        end_effector=study.end_effector,
        seed=config.seed,
    )
    best = config.grasps[0] if chosen.candidate is None else chosen.candidate.grasp
    grasp = config.grasp or best
    found = PlannedCapture(_result(chosen), chosen, grasp, age, observed=observed)
    if not chosen.success and isinstance(config.grasp_time.time, str):
        return found
    say(chosen.sentence)
    path = GraspPath.create(motion, grasp, age)
    found = replace(found, path=path, true_path=GraspPath.create(study.motion, grasp))
    time = fixed_time(config, found.time)
    if observed is not None:
        # Of a free time the criterion's is the first guess.
        found = replace(found, prediction=observed.prediction(study.target, grasp, time or found.time))
        if config.observation.convergence.required and not observed.converged(found.prediction):
            wrong = explain_capture(CaptureCode.ESTIMATE_NOT_CONVERGED)
            return replace(_with_truth(found, study, time or found.time), result=wrong)
    return _planned(config, study, found, geometry, time, say)


def _planned(config, study: CaptureStudy, found: PlannedCapture, geometry, time, say) -> PlannedCapture:
    path, settings = found.path, build_settings(config, time)
    model = build_clearance(config, study, geometry)
    plan = plan_capture(
        study.robot,
        path,
        study.initial_state,
        model,
        settings,
        terms=build_terms(config, study, path),
        improve=config.planner.improve,
        geometry=geometry,
        **_mode(study),
    )
    found = replace(found, result=plan.result, plan=plan)
    if plan.motion is None:
        return found if found.observed is None else _with_truth(found, study, time or found.time)
    if found.observed is not None:
        found = replace(found, prediction=found.observed.prediction(study.target, found.grasp, plan.duration))
        found = _with_truth(found, study, plan.duration)
        error = _missed(study.robot, plan.motion, found.true_path, study.end_effector)
        found = replace(found, true_error=np.asarray(error))
    if config.front is not None and plan.result.success:
        say("tracing the front")
        others = different_captures(
            study.robot, CaptureTask(path, model), study.initial_state, settings, **_mode(study)
        )
        say(f"{len(others)} starts lead to captures")
        front = capture_front(
            plan,
            build_indices(config, study, path),
            levels=config.front.levels,
            settings=settings,
            end_effector=study.end_effector,
            others=others,
        )
        found = replace(found, front=front)
    return found


@program(static_argnums=3, once=True)
def _missed(robot, motion, path: GraspPath, end_effector: str):
    return grasp_error(robot, motion, path, end_effector)


def _mode(study: CaptureStudy) -> dict:
    """Zero momentum is none, of which the planner knows more."""
    return {**study.mode, "momentum": study.momentum if np.any(study.momentum) else None}


def _with_truth(found: PlannedCapture, study: CaptureStudy, time: float) -> PlannedCapture:
    """What the prediction for this time misses the true grasp frame by."""
    position, quaternion, twist = grasp_frame(study.target, study.motion(time), found.grasp)
    # The predicted frame's attitude is that of the grasp frame, whatever the axes of T.
    error = prediction_error(found.prediction, position, quaternion, twist)
    return replace(found, prediction_error=np.asarray(jax.device_get(error)))


def _result(chosen: GraspTime) -> CaptureResult:
    code = _OF_TIME.get(chosen.code, CaptureCode.NOT_FOUND)
    return CaptureResult(code, chosen.sentence)
