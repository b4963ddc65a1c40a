"""When to grasp: the best time of the best grasp frame over a target's predicted motion, or why there is none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.capture.capability_map import CapabilityMap
from jffsr.capture.grasp_time_curves import GraspCandidate, GraspScan, scan_grasp
from jffsr.capture.inverse_kinematics import JointSolutions, random_starts
from jffsr.capture.inverse_kinematics_floating import floating_inverse_kinematics
from jffsr.dynamics.base_mode import FLOATING
from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.errors import InputError
from jffsr.planning.reachability import least_durations
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.target.grasp_frames import grasp_frame
from jffsr.target.tumbling import TargetMotion
from jffsr.types import Twist

SAMPLES = 2001
STARTS = 31
LARGEST_BOW = 1.0
"""rad or m: how far the way to a grasp may be bent when it is confirmed."""
_ITERATIONS = 20
_MOST_TRIED = 8


class GraspTimeCode(IntEnum):
    """0 is the only success."""

    FOUND = 0
    NEVER_NEAR = 1
    NEVER_FACING = 2
    NOT_CONFIRMED = 3


@dataclass(frozen=True)
class GraspTime:
    """When and where to grasp, on the host.

    code and a sentence; candidate, the one chosen, None where there is none; candidates, all local minima of all
    frames, best first; scans, the curves of each frame; solution, joint positions and base pose that a floating base
    allows there (no leading axis), None without confirmation.
    """

    code: GraspTimeCode
    sentence: str
    candidate: GraspCandidate | None
    candidates: tuple[GraspCandidate, ...]
    scans: tuple[GraspScan, ...]
    solution: JointSolutions | None = None

    @property
    def success(self) -> bool:
        """Whether a time was found and, where asked for, confirmed."""
        return self.code is GraspTimeCode.FOUND

    @property
    def time(self) -> float | None:
        """The time, s, of the target's motion; None where there is none."""
        return None if self.candidate is None else self.candidate.time


def grasp_time(
    robot: Robot,
    motion: TargetMotion,
    state: State,
    capability: CapabilityMap | None = None,
    *,
    grasps: Sequence[str] | None = None,
    window: tuple[float, float] | None = None,
    least_share: float = 0.0,
    samples: int = SAMPLES,
    confirm: bool = True,
    momentum: Twist | None = None,
    base_mode: str = FLOATING,
    end_effector: str | None = None,
    seed: int = 0,
) -> GraspTime:
    """The time and grasp frame of least (2 |rho| - n_x' rho)/(1 + D), Wang et al. (2021), eq. (15), with n_x' rho > 0.

    rho leads from the tool in `state`, the robot's start, to the grasp point at a time of the target's motion, n_x is
    the grasp frame's first axis, D the capability map's value at that point in the base frame of the start, above
    `least_share`; without a map D is 0 and every point counts as near. grasps, names, all the target's by default;
    window, s, the whole motion by default, at `samples` equal steps, minima polished between them. With `confirm` the
    candidates are tried in order, best first and eight at most, by `floating_inverse_kinematics` from `state` under
    `momentum`, in a motion that begins with the window: the way may be bent by up to a radian, and the time must be
    enough for the joints' rate and acceleration limits. Raises InputError for a window outside the motion, and for a
    map of another robot or end effector.
    """
    names = tuple(motion.target.grasp_names if grasps is None else grasps)
    start, end = _window(motion, window)
    if not names or samples < 3:
        raise InputError("grasp time: at least one grasp frame and three samples are expected")
    _check_map(robot, capability, end_effector)
    tool, _ = end_effector_pose(robot, kinematics(robot, state), end_effector)
    time = np.linspace(start, end, samples)
    scanned = [scan_grasp(motion, name, tool, state, capability, least_share, time) for name in names]
    scans = tuple(scan for scan, _ in scanned)
    candidates = tuple(sorted((c for _, found in scanned for c in found), key=lambda c: c.value))
    if not candidates:
        return GraspTime(*_none(scans, capability, start, end), None, (), scans)
    if not confirm:
        return GraspTime(GraspTimeCode.FOUND, _found(candidates[0]), candidates[0], candidates, scans)
    for candidate in candidates[:_MOST_TRIED]:
        solution = _confirmed(robot, motion, state, candidate, start, momentum, base_mode, end_effector, seed)
        if bool(solution.success):
            sentence = f"{_found(candidate)}, confirmed with the base {base_mode.replace('_', ' ')}"
            return GraspTime(GraspTimeCode.FOUND, sentence, candidate, candidates, scans, solution)
    tried = min(len(candidates), _MOST_TRIED)
    sentence = (
        f"not confirmed: with the base {base_mode.replace('_', ' ')} the tool reaches the grasp frame, in the time "
        f"there is, at none of the {tried} best times, the best of them {candidates[0].time:.4g} s; ask for a larger "
        f"share of the map (least_share), another grasp frame, or a longer window"
    )
    return GraspTime(GraspTimeCode.NOT_CONFIRMED, sentence, None, candidates, scans)


def _window(motion: TargetMotion, window: tuple[float, float] | None) -> tuple[float, float]:
    longest = float(motion.duration)
    start, end = (0.0, longest) if window is None else map(float, window)
    if not 0 <= start < end <= longest * (1 + 1e-12):
        raise InputError(
            f"grasp time: the window is [{start:g}, {end:g}] s; within the target's motion, [0, {longest:g}] s, and "
            f"not empty is expected"
        )
    return start, min(end, longest)


def _check_map(robot: Robot, capability: CapabilityMap | None, end_effector: str | None) -> None:
    if capability is None:
        return
    tool = robot.end_effector_names[robot.end_effector_index(end_effector)]
    if (capability.robot, capability.end_effector) != (robot.name, tool):
        raise InputError(
            f"grasp time: the capability map is of '{capability.robot}' with '{capability.end_effector}', the robot is "
            f"'{robot.name}' with '{tool}'"
        )


def _confirmed(robot, motion, state, candidate, begin, momentum, base_mode, end_effector, seed):
    position, quaternion, _ = grasp_frame(motion.target, motion(candidate.time), candidate.grasp)
    drawn = random_starts(robot, jax.random.key(seed), STARTS)
    starts = jnp.concatenate([jnp.asarray(state.joint_position)[None], drawn])
    # At the very beginning there is no time to move in.
    duration = max(candidate.time - begin, 1e-3)
    found = floating_inverse_kinematics(
        robot,
        position,
        quaternion,
        state,
        starts,
        momentum=momentum,
        duration=duration,
        largest_bow=LARGEST_BOW,
        base_mode=base_mode,
        end_effector=end_effector,
        iterations=_ITERATIONS,
    )
    here, goals = np.asarray(state.joint_position), np.asarray(found.joint_position)
    soon = [np.all(least_durations(robot, here, goal) <= duration) for goal in goals]
    return replace(found, success=found.success & np.array(soon)).best(here)


def _found(candidate: GraspCandidate) -> str:
    where = ", where a window begins or ends" if candidate.at_edge else ""
    return f"grasp '{candidate.grasp}' at {candidate.time:.4g} s{where}"


def _none(scans: tuple[GraspScan, ...], capability, start: float, end: float) -> tuple[GraspTimeCode, str]:
    frames = "the grasp frame" if len(scans) == 1 else f"any of the {len(scans)} grasp frames"
    over = f"between {start:g} and {end:g} s"
    if not any(scan.near.any() for scan in scans):
        nearest = min(scans, key=lambda scan: scan.distance.min())
        place = int(np.argmin(nearest.distance))
        return GraspTimeCode.NEVER_NEAR, (
            f"never near: {over} {frames} never comes to where the capability map of '{capability.robot}' says that "
            f"the arm can grasp; '{nearest.grasp}' is nearest to the tool, {nearest.distance[place]:.4g} m away, at "
            f"{nearest.time[place]:.4g} s; bring the base nearer or look further ahead"
        )
    best = max((scan for scan in scans if scan.near.any()), key=lambda scan: scan.facing[scan.near].max())
    place = np.flatnonzero(best.near)[np.argmax(best.facing[best.near])]
    angle = np.rad2deg(np.arccos(np.clip(best.facing[place], -1, 1)))
    return GraspTimeCode.NEVER_FACING, (
        f"never facing: {over} {frames} is within the arm's reach only while its approach axis points back at the tool "
        f"({angle:.0f} deg at best, for '{best.grasp}' at {best.time[place]:.4g} s; less than 90 is needed); choose "
        f"another grasp frame or come from another side"
    )
