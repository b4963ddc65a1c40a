"""What became of a capture: a code, and a sentence that says what to do."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from jffsr.planning.problem import Problem
from jffsr.planning.result import Tolerances, constraints_missed, limits_in_words, violations
from jffsr.planning.verification import Verification


class CaptureCode(IntEnum):
    """0 is the only success."""

    CAPTURED = 0
    NEVER_FACING = 1
    START_IN_COLLISION = 2
    GRASP_INSIDE_BODY = 3
    ESTIMATE_NOT_CONVERGED = 4
    NOT_FOUND = 5
    NOT_VERIFIED = 6


@dataclass(frozen=True)
class CaptureResult:
    """A code and a sentence of advice."""

    code: CaptureCode
    sentence: str

    @property
    def success(self) -> bool:
        """Whether the plan keeps every constraint on the finer grid of an independent re-run."""
        return self.code is CaptureCode.CAPTURED


def explain_capture(
    code: int,
    problem: Problem | None = None,
    verification: Verification | None = None,
    attempts: int = 0,
    tolerances: Tolerances | None = None,
) -> CaptureResult:
    """The sentence that goes with a code; problem and verification are needed for a plan that was made."""
    code, tolerances = CaptureCode(int(code)), tolerances or Tolerances()
    if code is CaptureCode.NEVER_FACING:
        text = (
            "no grasp time: over the whole window the grasp frame looks away from the tool; give a longer window, "
            "another grasp frame, or another start"
        )
    elif code is CaptureCode.START_IN_COLLISION:
        text = "the robot starts in collision with itself or the target; give another start"
    elif code is CaptureCode.GRASP_INSIDE_BODY:
        text = "the grasp frame lies inside the target's own body, where no tool can go; move it out"
    elif code is CaptureCode.ESTIMATE_NOT_CONVERGED:
        text = "the target's estimate has not converged, so that it cannot be predicted; observe for longer"
    elif code is CaptureCode.NOT_FOUND:
        text = (
            f"no capture was found in {attempts} attempts; allow more time, more starts or control points, or wider "
            f"limits"
        )
    elif code is CaptureCode.NOT_VERIFIED:
        missed = [*_unlike(verification, tolerances)]
        missed += constraints_missed(problem, verification)
        missed += violations(problem, verification.overruns, tolerances)
        text = (
            f"found, but not verified on the finer grid: {', '.join(missed)}; raise num_steps or the margin"
        )
    else:
        limits = "every limit" if problem is None else limits_in_words(problem)
        text = f"captured: pose and velocity match, and {limits}, and every constraint, is kept on the finer grid"
    return CaptureResult(code, text)


def _unlike(verification: Verification, tolerances: Tolerances):
    for what, value, allowed in (
        ("attitude of the base", verification.attitude_difference, tolerances.attitude),
        ("momentum", verification.momentum_drift, tolerances.momentum),
        ("ends of the joint motion", verification.boundary_error, tolerances.boundary),
    ):
        if not float(np.asarray(value)) <= allowed:
            yield f"{what} off by {float(np.asarray(value)):.3g} (allowed {allowed:g})"
