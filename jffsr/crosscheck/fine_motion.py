"""The motion that the engines are compared with where none is given, and what is asked of its arguments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import jax
import numpy as np

from jffsr.compiling import jit
from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.motion import SAMPLED, Motion
from jffsr.rollouts.reference import reference_rollout
from jffsr.trajectories.interface import Trajectory

_SAMPLES = 100
# The reference's Runge-Kutta step, s, is short beside any motion whose torques a 2 ms step can follow.
_REFERENCE_STEP = 0.01


def fine_motion(
    robot: Robot,
    trajectory: Trajectory,
    initial_state: State,
    duration: float,
    momentum: np.ndarray,
    *,
    stacked: bool = False,
) -> Motion:
    """A fine `reference_rollout` at 101 samples; for a stacked robot (K, ...) a motion with that axis too."""
    per_sample = max(1, int(np.ceil(duration / _SAMPLES / _REFERENCE_STEP)))

    def sampled(robot: Robot, start: State, momentum: jax.Array) -> Motion:
        motion = reference_rollout(robot, trajectory, start, duration, _SAMPLES * per_sample, momentum)
        return replace(motion, **{name: getattr(motion, name)[::per_sample] for name in SAMPLED})

    # Compiled as a whole: operation by operation, JAX would compile every one of them.
    run = jit(jax.vmap(sampled, in_axes=(0, None, None)) if stacked else sampled)
    return run(robot, initial_state, momentum)


def check_positive(what: str, seconds: float) -> float:
    """The duration or step, if it is positive and finite; else InputError."""
    if not (np.isfinite(seconds) and seconds > 0):
        raise InputError(f"{what} is {seconds:g} s; it must be positive and finite")
    return seconds


def check_momentum(momentum: Sequence[float] | jax.Array | None) -> np.ndarray:
    """The momentum (6,) as a host array, zero for None; InputError for anything else."""
    values = np.zeros(6) if momentum is None else np.asarray(momentum, dtype=float)
    if values.shape != (6,) or not np.all(np.isfinite(values)):
        raise InputError(
            f"momentum is {values.tolist()}; six finite numbers are expected, P in N s, then L in N m s"
        )
    return values
