"""One chain carried out: observed, planned, driven in MuJoCo, grasped, held; it ends at the first stage that fails."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import jax
import numpy as np

from jffsr.capture.contact_compound import Compound
from jffsr.capture.mujoco_approach import Approach, approach
from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.reactionless.estimation.models import KnownLoad
from jffsr.robots.state import State
from jffsr.spatial.rotation import quaternion_to_matrix
from jffsr.study.capture.building import CaptureStudy, clearance_model
from jffsr.study.capture.planned import PlannedCapture, plan_study
from jffsr.study.capture.summary import sizes
from jffsr.study.chain.grasping import compound_of, missed_by
from jffsr.study.chain.outcome import ChainCode, ChainResult
from jffsr.study.chain.schema import ChainConfig
from jffsr.study.reactionless.holding import Held, hold_still, load_in_tool
from jffsr.target.target_state import TargetState

_PARTS = (("position", "m"), ("attitude", "rad"), ("velocity", "m/s"), ("angular velocity", "rad/s"))


@dataclass(frozen=True)
class Chain:
    """The stages that were reached: planned, approach, missed (12,), the tool's errors to the true grasp frame at the
    grasp, compound and held."""

    result: ChainResult
    planned: PlannedCapture
    approach: Approach | None = None
    missed: np.ndarray | None = None
    compound: Compound | None = None
    held: Held | None = None


def carry_out(
    config: ChainConfig, study: CaptureStudy, say: Callable[[str], None] = lambda text: None
) -> Chain:
    """Carry the chain out; what cannot be done is told by the result's code."""
    planned = plan_study(config, study, say)
    if not planned.result.success:
        return Chain(ChainResult(ChainCode.NOT_PLANNED, planned.result.sentence), planned)
    say(f"planned a grasp after {planned.plan.duration:.4g} s")
    found = approach(
        study.robot,
        planned.plan.problem.trajectory.with_free(planned.plan.free),
        study.initial_state,
        clearance_model(config, study, study.geometry),
        replace(study.target, geometry=study.geometry),
        study.target_state,
        planned.plan.duration,
        study.momentum,
        samples=config.approach.samples,
        step=config.approach.step,
    )
    state, target_state = found.end
    grasp, tool = planned.grasp, study.end_effector
    error = np.asarray(missed_by(study.robot, state, study.target, target_state, grasp, tool))
    chain = Chain(ChainResult(ChainCode.GRASP_MISSED, ""), planned, found, error)
    wrong = grasp_refused(config, chain)
    if wrong is not None:
        return replace(chain, result=wrong)
    compound = compound_of(study.robot, state, study.target, target_state, tool)
    say(f"grasped; {np.linalg.norm(compound.momentum[3:]):.3g} N m s of angular momentum to be taken up")
    held = hold_of(config, study, compound, known_load(study, state, target_state, compound))
    code = ChainCode.HELD if held.success else ChainCode.NOT_HELD
    text = (
        f"The target is grasped and {held.sentence}."
        if held.success
        else f"The target is grasped, but {held.sentence}."
    )
    return replace(chain, result=ChainResult(code, text), compound=compound, held=held)


def hold_of(
    config: ChainConfig, study: CaptureStudy, compound: Compound, known: KnownLoad, in_mujoco: bool = False
) -> Held:
    """The base held still by the robot, which has the target in hand."""
    (held,) = hold_still(
        config.hold,
        study.robot,
        compound.robot,
        compound.state,
        known,
        study.end_effector,
        where=config.where("hold"),
        in_mujoco=in_mujoco,
    )
    return held


def known_load(study: CaptureStudy, state: State, target_state: TargetState, compound: Compound) -> KnownLoad:
    """The true load in the tool's frame, and the momentum: what no estimator but the one named so is told."""
    place, quaternion = jax.device_get(
        end_effector_pose(study.robot, kinematics(study.robot, state), study.end_effector)
    )
    turn = np.asarray(quaternion_to_matrix(np.asarray(target_state.quaternion)))
    load = load_in_tool(
        place,
        np.asarray(quaternion_to_matrix(quaternion)),
        float(study.target.mass),
        np.asarray(target_state.position),
        turn @ np.asarray(study.target.inertia) @ turn.T,
    )
    return KnownLoad(load, np.asarray(compound.momentum[3:]))


def grasp_refused(config: ChainConfig, chain: Chain) -> ChainResult | None:
    """Why there is no grasp: something touched on the way, or the tool is not where the grasp frame is; NaN is not."""
    if chain.approach.contacts:
        first = chain.approach.contacts[0]
        text = f"The approach failed in MuJoCo: {first}; observe for longer, or ask for a wider margin."
        return ChainResult(ChainCode.TOUCHED, text)
    found = sizes(chain.missed).values()
    over = [
        f"its {what} by {value:.2g} {unit} ({allowed:g} allowed)"
        for (what, unit), value, allowed in zip(_PARTS, found, config.grasp_tolerance.sizes, strict=True)
        if not value <= allowed
    ]
    if not over:
        return None
    text = f"The tool misses the grasp frame: {', '.join(over)}; observe for longer, or allow more."
    return ChainResult(ChainCode.GRASP_MISSED, text)
