"""How a tool is made to follow its target: the method of the rates and every number in it."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from numbers import Integral
from typing import Any

import jax
import numpy as np

from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.reading.did_you_mean import hint
from jffsr.robots.robot import REVOLUTE, Robot
from jffsr.robots.state import State
from jffsr.tracking.inverses import ADAPTIVE, METHODS
from jffsr.tracking.limits import LIMIT_RULES, SCALE
from jffsr.tracking.redundancy import SecondaryTask
from jffsr.tracking.tool_task import ALL, FREEDOMS
from jffsr.types import Array

INSTANT, MEAN = "instant", "mean"
FEEDFORWARDS = (INSTANT, MEAN)

_NAMED = {"method": METHODS, "limits": LIMIT_RULES, "freedom": FREEDOMS, "feedforward": FEEDFORWARDS}
_COUNTS = ("substeps", "integration_steps")
_NOT_NEGATIVE = ("lambda_max", "damping", "position_gain", "attitude_gain")
_POSITIVE = ("epsilon", "threshold")


def _static(default: Any) -> Any:
    return field(default=default, metadata={"static": True})


@register_dataclass
@dataclass(frozen=True)
class Tracker:
    """Resolved-rate tracking on the generalized Jacobian (Umetani and Yoshida 1989).

    lambda_max and epsilon shape the adaptive damping (Wu et al. 2018, eq. 16); damping is lambda of the damped and
    the largest lambda of the manipulability-scaled method, which has none above the manipulability `threshold`.
    position_gain and attitude_gain, 1/s, feed back the tool's pose error; zero is none. secondary: what is done with
    the joints' freedom that the tool leaves, the first before the second. These are traced.

    Static: method, of `METHODS`; period, s, between samples; substeps, how often the rates are found anew in a
    period, held in between; integration_steps of the base's Runge-Kutta rule while they are held; feedforward,
    the target's twist at the instant, or the mean one that takes the target to where it is next, with which the
    published peak rate and index are met to their digits;
    limits: ignore, scale the task, or redistribute it among the joints (`jffsr.tracking.limits`); freedom: which
    directions are tracked, all, all but roll about the tool's z, or the position only. Wrong values raise
    InputError in `check_tracker`, which `track` calls.
    """

    lambda_max: Array | float = 0.05
    epsilon: Array | float = 0.07
    damping: Array | float = 0.05
    threshold: Array | float = 0.05
    position_gain: Array | float = 0.0
    attitude_gain: Array | float = 0.0
    secondary: tuple[SecondaryTask, ...] = ()
    method: str = _static(ADAPTIVE)
    period: float = _static(0.25)
    substeps: int = _static(1)
    integration_steps: int = _static(4)
    feedforward: str = _static(MEAN)
    limits: str = _static(SCALE)
    freedom: str = _static(ALL)


def check_tracker(tracker: Tracker) -> None:
    """InputError for an unknown name, a count or a number out of its range; traced numbers are not looked at."""
    for name, allowed in _NAMED.items():
        value = getattr(tracker, name)
        if value not in allowed:
            raise InputError(
                f"tracker.{name} is {value!r}; allowed are {', '.join(allowed)}{hint(str(value), allowed)}"
            )
    for name in _COUNTS:
        value = getattr(tracker, name)
        if isinstance(value, bool) or not isinstance(value, Integral) or value < 1:
            raise InputError(f"tracker.{name} is {value!r}; a positive whole number is expected")
    if not (np.isfinite(tracker.period) and tracker.period > 0):
        raise InputError(f"tracker.period is {tracker.period:g} s; it must be positive and finite")
    for f in fields(tracker):
        value = getattr(tracker, f.name)
        if f.name not in _NOT_NEGATIVE + _POSITIVE or isinstance(value, jax.core.Tracer):
            continue
        least = "positive" if f.name in _POSITIVE else "zero or positive"
        values = np.asarray(value, dtype=float)
        allowed = (values > 0 if f.name in _POSITIVE else values >= 0) & np.isfinite(values)
        if not np.all(allowed):
            raise InputError(
                f"tracker.{f.name} is {values.ravel()[~allowed.ravel()][0]:g}; it must be {least}"
            )


def check_gains(tracker: Tracker, step: float) -> None:
    """InputError for feedback that would overshoot ever further: a gain of 2/step or more, per second."""
    for name in ("position_gain", "attitude_gain"):
        gain = getattr(tracker, name)
        if not isinstance(gain, jax.core.Tracer) and np.any(np.asarray(gain) * step >= 2):
            raise InputError(
                f"tracker.{name} is {np.max(gain):g} 1/s, which is unstable with rates held over {step:g} s; "
                f"it must be below {2 / step:g}"
            )


def check_start(robot: Robot, state: State) -> None:
    """InputError for a start outside the joints' limits, and for limits that contradict each other."""
    limits, topology = robot.limits, robot.topology
    parts = limits.position_lower, limits.position_upper, state.joint_position
    if any(isinstance(x, jax.core.Tracer) for x in parts):
        return
    for name, kind, lower, upper, q in zip(topology.joint_names, topology.joint_types, *parts, strict=True):
        scale, unit = (np.rad2deg(1.0), "deg") if kind == REVOLUTE else (1.0, "m")
        box = f"[{lower * scale:g}, {upper * scale:g}] {unit}"
        if lower > upper:
            raise InputError(f"{name} has the limits {box}, which contradict each other")
        if not lower <= q <= upper:
            raise InputError(f"{name} starts at {float(q) * scale:g} {unit}, outside its limits of {box}")
