"""Result codes: what became of a plan, as a number in arrays and as a sentence of advice on the host."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum

import jax.numpy as jnp
import numpy as np

from jffsr.objectives.clearance import Clearance
from jffsr.objectives.constraints import in_units, tolerance_of
from jffsr.objectives.torque_terms import JointTorque, TorqueLimit
from jffsr.planning.problem import Problem
from jffsr.planning.verification import Overruns, Verification
from jffsr.rollouts.motion import Motion
from jffsr.types import Array

LIMIT_KINDS = ("position", "rate", "acceleration", "excursion", "torque")
"""The limits that a plan is held to, as the fields of `Overruns` name them."""


class ResultCode(IntEnum):
    """0 is the only success."""

    ACCURACY_MET = 0
    ACCURACY_NOT_MET = 1
    LIMITS_VIOLATED = 2
    NOT_CONVERGED = 3
    NOT_VERIFIED = 4
    NOT_FINITE = 5
    CONSTRAINTS_VIOLATED = 6


@dataclass(frozen=True)
class Tolerances:
    """What the verification must keep: limits (relative), attitude (rad), momentum (relative), boundary."""

    limit: float = 1e-3
    attitude: float = 1e-6
    momentum: float = 1e-6
    boundary: float = 1e-8


@dataclass(frozen=True)
class Result:
    """A code, its name, and a sentence that says what to do."""

    code: ResultCode
    sentence: str

    @property
    def success(self) -> bool:
        """Whether the accuracy asked for was met and verified."""
        return self.code is ResultCode.ACCURACY_MET


def result_code(
    problem: Problem, verification: Verification, converged: Array, tolerances: Tolerances
) -> Array:
    """The code as an int32 array; works under vmap. `converged` is whether the search had come to its end."""
    largest = jnp.max(jnp.concatenate([getattr(verification.overruns, kind) for kind in LIMIT_KINDS]))
    finite = jnp.isfinite(verification.cost) & jnp.isfinite(verification.measure)
    verified = (
        (verification.attitude_difference <= tolerances.attitude)
        & (verification.momentum_drift <= tolerances.momentum)
        & (verification.boundary_error <= tolerances.boundary)
    )
    met = jnp.maximum(verification.cost, verification.measure) <= problem.objective.accuracy
    short = jnp.where(converged, ResultCode.ACCURACY_NOT_MET, ResultCode.NOT_CONVERGED)
    code = jnp.where(met, ResultCode.ACCURACY_MET, short)
    code = jnp.where(met & (largest > tolerances.limit), ResultCode.LIMITS_VIOLATED, code)
    for constraint in problem.constraints:
        kept = verification.violations[constraint.name] <= tolerance_of(constraint)
        code = jnp.where(kept, code, ResultCode.CONSTRAINTS_VIOLATED)
    code = jnp.where(verified, code, ResultCode.NOT_VERIFIED)
    return jnp.where(finite, code, ResultCode.NOT_FINITE).astype(jnp.int32)


def settled(best_values: Array) -> Array:
    """Whether the last tenth of a search's steps (K,) bettered its index by no more than 1 %.

    Host arrays stay on the host: the number of steps differs from plan to plan, and each would be compiled for.
    """
    steps = best_values.shape[0]
    if steps < 2:
        return np.array(False)
    return stands_still(best_values[-1 - max(1, steps // 10)], best_values[-1])


def stands_still(earlier: Array | float, last: Array | float) -> Array | bool:
    """Whether the later of two best values is better by no more than 1 %."""
    return (abs(earlier) < np.inf) & (earlier <= last + 0.01 * abs(earlier))


def explain(
    code: int,
    problem: Problem,
    verification: Verification,
    tolerances: Tolerances,
    motion: Motion | None = None,
) -> Result:
    """The sentence of advice that goes with a code; host only. With the motion it names bodies that come too near."""
    code = ResultCode(int(code))
    cost = float(np.maximum(verification.cost, verification.measure))
    accuracy, index = float(problem.objective.accuracy), "J"
    if problem.uncertainty is not None:
        index = f"J over {len(problem.uncertainty.robots.mass)} robots"
    broken = list(violations(problem, verification.overruns, tolerances))
    missed = ", ".join(constraints_missed(problem, verification, motion))
    limits = limits_in_words(problem)
    also = f"; limits violated: {', '.join(broken)}" if broken else f"; {limits} is kept"
    binding = _binding(verification)
    if code is ResultCode.ACCURACY_MET:
        kept = f"{limits}, and every constraint, is" if problem.constraints else f"{limits} is"
        text = f"accuracy met: {index} = {cost:.4g} <= {accuracy:g}, and {kept} kept on the finer grid"
    elif code is ResultCode.CONSTRAINTS_VIOLATED:
        if motion is not None and _kept_between(problem, verification, motion):
            advice = "the search had kept them at its own steps, so raise rollout.num_steps"
        else:
            advice = (
                "allow more time or more free numbers of the trajectory, raise the budget of the gradients, or "
                "rollout.num_steps where the search had kept them"
            )
        text = f"constraints violated on the finer grid: {missed}; {index} = {cost:.4g}; {advice}"
    elif code is ResultCode.LIMITS_VIOLATED:
        text = (
            f"{index} = {cost:.4g} <= {accuracy:g}, but limits are violated: {', '.join(broken)}; lower the scale of "
            f"that term, or allow more time"
        )
    elif code is ResultCode.ACCURACY_NOT_MET:
        text = (
            f"accuracy not met: {index} = {cost:.4g} > {accuracy:g}, bound by {binding}{also}; the search had "
            f"converged, so allow more time or excursion, or try more starts"
        )
    elif code is ResultCode.NOT_CONVERGED:
        text = (
            f"accuracy not met: {index} = {cost:.4g} > {accuracy:g}, bound by {binding}{also}; the search was still "
            f"moving when its budget ended, so raise the budget (a hybrid's are its swarm_evaluations, starts, "
            f"gradient_iterations and polish_iterations), or allow more time or excursion"
        )
    elif code is ResultCode.NOT_VERIFIED:
        text = (
            "not verified: " + ", ".join(_unverified(verification, tolerances)) + "; raise rollout.num_steps"
        )
    else:
        text = (
            "no finite index was found: every candidate gave NaN or infinity; check the robot and the terms"
        )
    return Result(code, text)


def _binding(verification: Verification) -> str:
    name, term = max(verification.terms.items(), key=lambda item: float(item[1].weighted))
    return f"{name} ({float(term.weighted):.3g} of J)"


def _unverified(verification: Verification, tolerances: Tolerances) -> Iterator[str]:
    for what, unit in (
        ("attitude_difference", " rad"),
        ("momentum_drift", " relative"),
        ("boundary_error", ""),
    ):
        value, allowed = float(getattr(verification, what)), getattr(tolerances, what.split("_")[0])
        if not value <= allowed:
            yield f"{what.replace('_', ' ')} of {value:.3g}{unit} (allowed {allowed:g})"


def constraints_missed(
    problem: Problem, verification: Verification, motion: Motion | None = None
) -> Iterator[str]:
    """Each constraint that the finer run misses by more than its tolerance, and by how much; of a motion also where."""
    for constraint in problem.constraints:
        missed, allowed = float(verification.violations[constraint.name]), float(tolerance_of(constraint))
        if not missed <= allowed:
            where = ""
            if motion is not None and isinstance(constraint, Clearance):
                near, margin = constraint.nearest(problem.robot, motion), float(np.asarray(constraint.margin))
                where = f"; at the planner's step {near}, the margin is {margin:g} m"
            (missed, unit), (allowed, _) = (in_units(constraint, amount) for amount in (missed, allowed))
            unit = f" {unit}" if unit else ""
            yield f"{constraint.name} by {missed:.3g}{unit} (allowed {allowed:.3g}{unit}{where})"


def limits_in_words(problem: Problem) -> str:
    """What can be said to be kept where no limit is overrun."""
    return "every limit but those of torque" if torque_unseen(problem) else "every limit"


def torque_unseen(problem: Problem) -> bool:
    """Whether the robot has limits of torque that no term and no constraint of the problem holds a motion to."""
    looked_at = (*problem.objective.terms, *problem.constraints)
    limited = bool(np.any(np.isfinite(problem.robot.limits.torque)))
    return limited and not any(isinstance(one, JointTorque | TorqueLimit) for one in looked_at)


def _kept_between(problem: Problem, verification: Verification, motion: Motion) -> bool:
    """Whether all that the finer run misses are clearances that are kept at the motion's own samples."""
    missed = [
        one for one in problem.constraints if not verification.violations[one.name] <= tolerance_of(one)
    ]
    return all(
        isinstance(one, Clearance)
        and one.nearest(problem.robot, motion).distance >= one.margin - in_units(one, tolerance_of(one))[0]
        for one in missed
    )


def violations(problem: Problem, overruns: Overruns, tolerances: Tolerances) -> Iterator[str]:
    """Each limit that is overrun by more than the tolerance, with its joint or axis and by how much."""
    for kind in LIMIT_KINDS:
        names = "xyz" if kind == "excursion" else problem.robot.joint_names
        of = "base attitude excursion about" if kind == "excursion" else f"{kind} of"
        for name, overrun in zip(names, np.asarray(getattr(overruns, kind)), strict=True):
            if overrun > tolerances.limit:
                yield f"{of} {name} by {100 * overrun:.3g} %"
