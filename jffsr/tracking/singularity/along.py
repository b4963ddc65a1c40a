"""The singularities along a motion of a robot."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jffsr.dynamics.base_mode import FLOATING, base_freedom
from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.tracking.singularity.between import Between
from jffsr.tracking.singularity.events import Event, find_stretches
from jffsr.tracking.singularity.measures import PostureJacobians, many_jacobians, measures
from jffsr.tracking.singularity.nearest import Bounds, Nearest, kind_of, nearest_singular
from jffsr.tracking.singularity.report import SingularInterval, SingularityReport, SingularPoint
from jffsr.tracking.singularity.task import DIRECTIONS, NEAR_SHARE, TOOL, ToolTask, joint_scale, make_task

# Each interval between samples is looked at in so many parts, so that no short dip goes by unseen.
_PARTS = 4


def singularities(
    robot: Robot,
    motion: object,
    end_effector: str | None = None,
    *,
    directions: str | Sequence[str] | None = None,
    frame: str = "inertial",
    length_scale: float = 1.0,
    threshold: float | None = None,
    bounds: Bounds | None = None,
    base_mode: str | None = None,
) -> SingularityReport:
    """Where along a motion the tool loses directions: when, how near, which, through which joints, and of what kind.

    motion: a Motion, a result that has one as `motion`, or `Postures`; between its samples the joints follow their
    positions and rates, and instants are found to 1e-6 s. directions, of x, y, z, about_x, about_y, about_z in the
    `frame` I (inertial) or E (tool): those that the task asks for, None for all six. One radian counts as
    `length_scale`, m, in singular values and in all that follows from them. threshold, m, of the smallest singular
    value: a thirtieth of the motion's median largest one by default. base_mode: the motion's own by default, else
    floating.

    Kinematic is a singularity whose posture lies within bounds.kinematic_within (5 deg) of one where J_m, the Jacobian
    with the base held, loses the same direction; dynamic is one with no such posture within bounds.dynamic_beyond
    (10 deg) (Papadopoulos and Dubowsky 1993); mixed is what lies between. Raises InputError for a motion that does
    not fit the robot and for unknown names.
    """
    task = make_task(directions, frame, length_scale)
    between = Between(robot, motion)
    mode = base_mode or getattr(getattr(motion, "motion", motion), "base_mode", FLOATING)
    base_freedom(mode)
    index = robot.end_effector_index(end_effector)
    search = _Search(robot, between, robot.end_effector_names[index], mode, task)

    at_samples = search.jacobians(between.time)
    found = measures(at_samples.generalized)
    scale = float(np.median(found.singular_values[:, 0]))
    if threshold is None:
        threshold = NEAR_SHARE * scale
    if not threshold > 0:
        raise InputError(f"threshold is {threshold}; it must be positive")
    determinant = None if found.determinant is None else search.determinant
    stretches, closest = find_stretches(
        between.finer(_PARTS), search.smallest, determinant, float(threshold), scale
    )
    events = [*(event for stretch in stretches for event in stretch.events), closest]
    points = search.points(events, float(threshold), bounds or Bounds())
    intervals, first = [], 0
    for stretch in stretches:
        last = first + len(stretch.events)
        intervals.append(SingularInterval(stretch.start, stretch.end, tuple(points[first:last])))
        first = last
    return SingularityReport(
        robot=robot.name,
        joint_names=robot.joint_names,
        joint_is_revolute=tuple(bool(turns) for turns in robot.topology.is_revolute),
        end_effector=robot.end_effector_names[index],
        base_mode=mode,
        task=task,
        threshold=float(threshold),
        time=between.time,
        singular_values=found.singular_values,
        determinant=found.determinant,
        manipulability=found.manipulability,
        condition_number=found.condition_number,
        fixed_base_singular_value=measures(at_samples.fixed).singular_values[:, -1],
        intervals=tuple(intervals),
        closest=points[-1],
    )


class _Search:
    """The measures of one motion at any times, and what its singular instants are like."""

    def __init__(self, robot: Robot, between: Between, end_effector: str, base_mode: str, task: ToolTask):
        self._robot, self._between, self._task = robot, between, task
        self._rest = (end_effector, base_mode, task)

    def jacobians(self, times: np.ndarray) -> PostureJacobians:
        """Both Jacobians and the tool at times (p,)."""
        _, quaternion = self._between.base(times)
        return many_jacobians(self._robot, self._between.joints(times), quaternion, *self._rest)

    def smallest(self, times: np.ndarray) -> np.ndarray:
        """The smallest singular value (p,), m."""
        return measures(self.jacobians(times).generalized).singular_values[:, -1]

    def determinant(self, times: np.ndarray) -> np.ndarray:
        """The determinant (p,)."""
        return np.linalg.det(self.jacobians(times).generalized)

    def points(self, events: Sequence[Event], threshold: float, bounds: Bounds) -> list[SingularPoint]:
        """What the events are like."""
        times = np.array([event.time for event in events])
        joints = self._between.joints(times)
        position, quaternion = self._between.base(times)
        found = self.jacobians(times)
        near = nearest_singular(self._robot, joints, quaternion, *self._rest)
        return [
            self._point(i, event, joints[i], position[i], found, near, threshold, bounds)
            for i, event in enumerate(events)
        ]

    def _point(
        self,
        i: int,
        event: Event,
        joints: np.ndarray,
        base_position: np.ndarray,
        found: PostureJacobians,
        near: Nearest,
        threshold: float,
        bounds: Bounds,
    ) -> SingularPoint:
        matrix, task = found.generalized[i], self._task
        left, values, right = np.linalg.svd(matrix, full_matrices=False)
        # At least one, and all that are as good as lost: two may go at once.
        count = max(1, int(np.sum(values < threshold)))
        lost = np.zeros((count, len(DIRECTIONS)))
        lost[:, task.rows] = left[:, ::-1].T[:count]
        rotation = found.tool_rotation[i]
        turned = lost.reshape(count, 2, 3) @ (rotation.T if task.frame == TOOL else rotation)
        turned = turned.reshape(count, 6)
        motions = right[::-1][:count] * joint_scale(self._robot, task)
        at_point = measures(matrix[None])
        distance, fixed_distance = float(near.generalized.distance[i]), float(near.fixed.distance[i])
        known = np.isfinite(distance)
        return SingularPoint(
            time=event.time,
            joint_position=joints,
            tool_position=base_position + found.tool_offset[i],
            singular_values=values,
            determinant=None if at_point.determinant is None else float(at_point.determinant[0]),
            manipulability=float(at_point.manipulability[0]),
            condition_number=float(at_point.condition_number[0]),
            crossing=event.crossing,
            lost_I=turned if task.frame == TOOL else lost,
            lost_E=lost if task.frame == TOOL else turned,
            idle_joints=motions / np.linalg.norm(motions, axis=1, keepdims=True),
            fixed_base_singular_value=float(measures(found.fixed[i][None]).singular_values[0, -1]),
            singular_posture=near.generalized.joint_position[i] if known else None,
            posture_distance=distance if known else None,
            fixed_base_distance=fixed_distance if known and np.isfinite(fixed_distance) else None,
            alignment=float(near.alignment[i]),
            kind=kind_of(distance, fixed_distance, float(near.alignment[i]), bounds),
        )
