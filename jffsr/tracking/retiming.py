"""The fastest timing of a tool's path under the robot's own limits of rate and acceleration.

With zero momentum the joint rates along a path are proportional to ds/dt, whatever the base does (a time scaling of a
motion conserves zero momentum), so that the joints' way over s is found once, by tracking the path slowly, and its
slopes bound the rates (Bobrow 1985; Shin and McKay 1985).
"""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.compiling import program
from jffsr.dynamics.base_mode import FLOATING
from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.tracking.limits import IGNORE
from jffsr.tracking.tracker import MEAN, Tracker, check_tracker
from jffsr.tracking.tracking import track
from jffsr.trajectories.cartesian.fastest import fastest_timing, rate_bound
from jffsr.trajectories.cartesian.interface import ToolPath
from jffsr.trajectories.cartesian.tabulated import Tabulated
from jffsr.trajectories.cartesian.timing import Uniform
from jffsr.trajectories.cartesian.tool_trajectory import ToolTrajectory

# Deadbeat feedback of the pose error would be 1 over a step; half of it keeps the way on the path without ringing.
_FEEDBACK = 0.5


@program(static_argnums=(4, 5, 6), once=True)
def _slopes(
    robot: Robot, path: ToolPath, state: State, tracker: Tracker, steps: int, end_effector, base_mode
):
    """The joints' slopes by s (steps + 1, n), from a uniform timing of one second."""
    target = ToolTrajectory(path, Uniform(jnp.ones(())))
    tracked = track(robot, target, state, tracker, 1.0, None, end_effector, base_mode, steps)
    held = tracked.motion.joint_velocity[:-1]
    # Rates belong to the middles of the steps that they are held over; the ends are those of the first and the last.
    inner = 0.5 * (held[1:] + held[:-1])
    return jnp.concatenate([held[:1], inner, held[-1:]])


def fastest_tracking(
    robot: Robot,
    path: ToolPath,
    initial_state: State,
    tracker: Tracker,
    margin: float = 0.02,
    steps: int = 400,
    end_effector: str | None = None,
    base_mode: str = FLOATING,
) -> Tabulated:
    """The fastest timing from rest to rest at which a tracker of this method keeps the robot's limits, on the host.

    Only for zero momentum. Rates, and accelerations where the robot has limits for all joints, are kept with `margin`
    to spare, since a tracker's held rates are not those of the continuous way; steps (static), of the grid over s.
    Raises InputError for a robot without rate limits, and for a margin outside [0, 1).
    """
    check_tracker(tracker)
    if not 0 <= margin < 1:
        raise InputError(f"margin is {margin:g}; a number in [0, 1) is expected")
    rates, accelerations = (
        (1 - margin) * np.asarray(x) for x in (robot.limits.velocity, robot.limits.acceleration)
    )
    if not np.all(np.isfinite(rates)):
        raise InputError(
            f"robot '{robot.name}' has joints without a rate limit; a fastest timing needs one for each"
        )
    gain = _FEEDBACK * steps
    slow = replace(
        tracker,
        feedforward=MEAN,
        limits=IGNORE,
        period=1.0 / steps,
        substeps=1,
        position_gain=gain,
        attitude_gain=gain,
    )
    slopes = np.asarray(_slopes(robot, path, initial_state, slow, steps, end_effector, base_mode))
    places = np.linspace(0.0, 1.0, steps + 1)
    bound = np.array(rate_bound(slopes, rates))
    if not np.all(np.isfinite(accelerations)):
        # Without limits of acceleration the rates may jump, but at the ends the tool rests.
        return _host(fastest_timing(places, bound))
    bends = np.gradient(slopes, places, axis=0)
    return _host(fastest_timing(places, bound, slopes, bends, accelerations))


def _host(timing: Tabulated) -> Tabulated:
    return jax.tree.map(np.asarray, timing)


def stretched(timing: Tabulated, period: float) -> Tabulated:
    """The timing slowed down until its duration is a whole number of periods, s."""
    duration = float(timing.duration)
    return timing.to_last(period * np.ceil(duration / period - 1e-9))
