"""What a search for singularities found, as data, as text and as plain values for a file."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from jffsr.tracking.singularity.task import DIRECTIONS, INERTIAL, ToolTask
from jffsr.tracking.singularity.words import direction_in_words, joints_in_words

# A posture this near, rad, to a singular one counts as being there.
_THERE = 1e-6


@dataclass(frozen=True)
class SingularPoint:
    """One instant at which the tool is nearest to losing a direction.

    time, s; joint_position (n,); tool_position (3,), m, in I. singular_values, m, largest first, determinant (None
    where the task's Jacobian is not square), manipulability and condition_number of the task's generalized Jacobian;
    crossing says that the determinant changes its sign here. lost_I and lost_E (r, 6), unit twists in I and in the
    tool's frame with turns times the length scale, the most lost first; idle_joints (r, n), unit joint motions that
    move the tool least. fixed_base_singular_value, m, the smallest one of J_m at this posture. singular_posture (n,),
    the nearest posture where the generalized Jacobian loses rank, and posture_distance, rad, to it, None where none
    was found; fixed_base_distance, rad, from there to the nearest posture where J_m loses rank (None likewise), and
    alignment, 0 to 1, of the directions that the two lose. kind: kinematic, dynamic or mixed.
    """

    time: float
    joint_position: np.ndarray
    tool_position: np.ndarray
    singular_values: np.ndarray
    determinant: float | None
    manipulability: float
    condition_number: float
    crossing: bool
    lost_I: np.ndarray
    lost_E: np.ndarray
    idle_joints: np.ndarray
    fixed_base_singular_value: float
    singular_posture: np.ndarray | None
    posture_distance: float | None
    fixed_base_distance: float | None
    alignment: float
    kind: str

    @property
    def smallest(self) -> float:
        """The smallest singular value, m."""
        return float(self.singular_values[-1])


@dataclass(frozen=True)
class SingularInterval:
    """A stretch of a motion, s, where the smallest singular value is below the threshold, with its worst instants."""

    start: float
    end: float
    points: tuple[SingularPoint, ...]


@dataclass(frozen=True)
class SingularityReport:
    """Where a motion is near a singularity, with the measures at its samples.

    time (k,), s; singular_values (k, min(m, n)), m, determinant (k,) or None, manipulability and condition_number (k,)
    of the generalized Jacobian of the m directions of the task; fixed_base_singular_value (k,), the smallest of J_m.
    threshold, m, of the smallest singular value; intervals; closest, the instant of the whole motion that is nearest to
    a singularity, whether below the threshold or not.
    """

    robot: str
    joint_names: tuple[str, ...]
    joint_is_revolute: tuple[bool, ...]
    end_effector: str
    base_mode: str
    task: ToolTask
    threshold: float
    time: np.ndarray
    singular_values: np.ndarray
    determinant: np.ndarray | None
    manipulability: np.ndarray
    condition_number: np.ndarray
    fixed_base_singular_value: np.ndarray
    intervals: tuple[SingularInterval, ...]
    closest: SingularPoint

    @property
    def near(self) -> np.ndarray:
        """Which samples (k,) are below the threshold."""
        return self.singular_values[:, -1] < self.threshold

    def to_text(self) -> str:
        """The report as lines to read."""
        task = self.task
        what = "six directions" if task.directions == DIRECTIONS else ", ".join(task.directions)
        frame = (
            ""
            if task.directions == DIRECTIONS
            else " of I"
            if task.frame == INERTIAL
            else " of the tool's frame"
        )
        lines = [
            f"Singularities of '{self.robot}' over {self.time[-1] - self.time[0]:g} s: end effector "
            f"'{self.end_effector}' in {what}{frame}, base {self.base_mode.replace('_', ' ')}, "
            f"1 rad counted as {task.length_scale:g} m.",
        ]
        if not self.intervals:
            lines.append(
                f"The smallest singular value never falls below {self.threshold:.3g} m; nearest to it:"
            )
            lines += self._point_lines(self.closest)
        for interval in self.intervals:
            lines.append(
                f"From {interval.start:.3f} s to {interval.end:.3f} s the smallest singular value is below "
                f"{self.threshold:.3g} m."
            )
            for point in interval.points:
                lines += self._point_lines(point)
        return "\n".join(lines)

    def _point_lines(self, point: SingularPoint) -> list[str]:
        joints = ", ".join(
            f"{name} {np.rad2deg(q) + 0.0:.2f} deg" if turns else f"{name} {q:.4g} m"
            for name, q, turns in zip(
                self.joint_names, point.joint_position, self.joint_is_revolute, strict=True
            )
        )
        how = (
            "the determinant changes its sign" if point.crossing else f"smallest value {point.smallest:.3g} m"
        )
        lines = [f"  {point.time:.6f} s: {how}, condition number {point.condition_number:.3g}; at {joints}"]
        for lost, idle in zip(point.lost_E, point.idle_joints, strict=True):
            lines.append(
                f"    {'lost' if point.smallest < self.threshold else 'weakest'}: {direction_in_words(lost)}"
            )
            lines.append(f"    joints that hardly move the tool: {joints_in_words(idle, self.joint_names)}")
        return [*lines, f"    {_kind_sentence(point)}"]

    def to_dict(self) -> dict:
        """The report as plain values for a file: numbers, words, lists; without the measures at the samples."""
        return {
            "robot": self.robot,
            "end_effector": self.end_effector,
            "base_mode": self.base_mode,
            "directions": list(self.task.directions),
            "frame": self.task.frame,
            "length_scale": self.task.length_scale,
            "threshold": self.threshold,
            "closest": self._point_dict(self.closest),
            "intervals": [
                {
                    "start": interval.start,
                    "end": interval.end,
                    "points": [self._point_dict(point) for point in interval.points],
                }
                for interval in self.intervals
            ],
        }

    def _point_dict(self, point: SingularPoint) -> dict:
        values = {field.name: getattr(point, field.name) for field in fields(point)}
        plain = {name: v.tolist() if isinstance(v, np.ndarray) else v for name, v in values.items()}
        # JSON has no infinity.
        plain["condition_number"] = None if np.isinf(point.condition_number) else point.condition_number
        plain["lost_in_words"] = [direction_in_words(lost) for lost in point.lost_E]
        plain["idle_in_words"] = [joints_in_words(idle, self.joint_names) for idle in point.idle_joints]
        return plain


def _kind_sentence(point: SingularPoint) -> str:
    if point.posture_distance is None:
        return f"{point.kind}: no singular posture was found near, so that the kind cannot be told"
    where = (
        "this posture is singular"
        if point.posture_distance < _THERE
        else f"the nearest singular posture is {np.rad2deg(point.posture_distance):.3g} deg away"
    )
    if point.fixed_base_distance is None:
        return f"{point.kind}: {where}; with the base held none was found near it"
    away = f"{np.rad2deg(point.fixed_base_distance):.3g} deg away"
    there = "there too" if point.fixed_base_distance < _THERE else away
    agree = f"losing a direction that agrees to {point.alignment:.3f}"
    return f"{point.kind}: {where}; with the base held the arm is singular {there}, {agree}"
