"""How much of a robot's joint space is near a singularity, and of what kind, without a motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from jffsr.dynamics.base_mode import FLOATING, base_freedom
from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.tracking.singularity.measures import many_jacobians, measures
from jffsr.tracking.singularity.nearest import DYNAMIC, KINEMATIC, MIXED, Bounds, kind_of, nearest_singular
from jffsr.tracking.singularity.task import NEAR_SHARE, make_task


@dataclass(frozen=True)
class SingularityScan:
    """What a scan of the joint space found.

    num_postures looked at; threshold, m, of the smallest singular value; share_near of them below it, and its standard
    error, which holds for random postures; smallest, m, the least found, at joint_position (n,). Of `classified`
    postures below it kinematic, dynamic and mixed are the counts.
    """

    robot: str
    num_postures: int
    threshold: float
    share_near: float
    standard_error: float
    smallest: float
    joint_position: np.ndarray
    classified: int
    kinematic: int
    dynamic: int
    mixed: int

    @property
    def dynamic_share(self) -> float:
        """Share of the classified postures that are near a dynamic singularity; zero where none was classified."""
        return self.dynamic / self.classified if self.classified else 0.0

    def to_text(self) -> str:
        """The scan in two sentences."""
        text = (
            f"Of {self.num_postures} postures of '{self.robot}' {100 * self.share_near:.2f} % "
            f"(+-{100 * self.standard_error:.2f} %) have a smallest singular value below {self.threshold:.3g} m; the "
            f"least is {self.smallest:.3g} m."
        )
        if self.classified:
            text += (
                f" Of {self.classified} of these, {self.kinematic} are near a kinematic singularity, {self.dynamic} "
                f"near a dynamic one, and of {self.mixed} the kind cannot be told."
            )
        return text

    def to_dict(self) -> dict:
        """The scan as plain values for a file."""
        return {
            **asdict(self),
            "joint_position": self.joint_position.tolist(),
            "dynamic_share": self.dynamic_share,
        }


def singularity_scan(
    robot: Robot,
    postures: int | np.ndarray = 2000,
    end_effector: str | None = None,
    *,
    seed: int = 0,
    directions: str | Sequence[str] | None = None,
    frame: str = "inertial",
    length_scale: float = 1.0,
    threshold: float | None = None,
    bounds: Bounds | None = None,
    base_mode: str = FLOATING,
    most_classified: int = 200,
) -> SingularityScan:
    """Share of a robot's postures near a singularity, the worst of them, and the share of dynamic singularities.

    postures: how many to draw from a seed, uniformly within the joint limits (a turning joint without limits within
    half a turn either way), or the postures themselves (p, n), for instance `grid_postures`. The base stands with the
    axes of I, which only matters where not all directions count. Up to `most_classified` postures below the threshold,
    the first found, are followed to their singular posture; the other arguments are as in `singularities`. Raises
    InputError for a sliding joint without limits, and for unknown names.
    """
    task = make_task(directions, frame, length_scale)
    base_freedom(base_mode)
    name = robot.end_effector_names[robot.end_effector_index(end_effector)]
    if isinstance(postures, int):
        if postures < 1:
            raise InputError(f"postures is {postures}; it must be at least 1")
        lower, upper = _range(robot)
        postures = np.random.default_rng(seed).uniform(lower, upper, (postures, robot.num_joints))
    postures = np.asarray(postures, dtype=float)
    if postures.ndim != 2 or postures.shape[1] != robot.num_joints or not len(postures):
        raise InputError(f"postures has shape {postures.shape}; '{robot.name}' needs (p, {robot.num_joints})")
    if not np.all(np.isfinite(postures)):
        raise InputError("postures is not finite")
    if threshold is not None and not threshold > 0:
        raise InputError(f"threshold is {threshold}; it must be positive")
    base = np.broadcast_to([1.0, 0.0, 0.0, 0.0], (len(postures), 4))

    found = measures(many_jacobians(robot, postures, base, name, base_mode, task).generalized).singular_values
    level = NEAR_SHARE * float(np.median(found[:, 0])) if threshold is None else float(threshold)
    near = np.flatnonzero(found[:, -1] < level)
    share, worst = len(near) / len(postures), int(np.argmin(found[:, -1]))
    chosen = near[:most_classified]
    kinds: list[str] = []
    if len(chosen):
        followed = nearest_singular(robot, postures[chosen], base[chosen], name, base_mode, task)
        each = zip(followed.generalized.distance, followed.fixed.distance, followed.alignment, strict=True)
        kinds = [kind_of(*distances, bounds or Bounds()) for distances in each]
    return SingularityScan(
        robot=robot.name,
        num_postures=len(postures),
        threshold=level,
        share_near=share,
        standard_error=float(np.sqrt(share * (1 - share) / len(postures))),
        smallest=float(found[worst, -1]),
        joint_position=postures[worst],
        classified=len(kinds),
        kinematic=kinds.count(KINEMATIC),
        dynamic=kinds.count(DYNAMIC),
        mixed=kinds.count(MIXED),
    )


def grid_postures(robot: Robot, per_joint: int) -> np.ndarray:
    """The postures (per_joint^n, n) of a grid within the joint limits, in the middles of its cells."""
    if per_joint < 1:
        raise InputError(f"per_joint is {per_joint}; it must be at least 1")
    lower, upper = _range(robot)
    middles = (np.arange(per_joint) + 0.5) / per_joint
    lines = [low + (high - low) * middles for low, high in zip(lower, upper, strict=True)]
    return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, robot.num_joints)


def _range(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    lower, upper = np.asarray(robot.limits.position_lower), np.asarray(robot.limits.position_upper)
    open_ended = ~(np.isfinite(lower) & np.isfinite(upper))
    slides = open_ended & ~robot.topology.is_revolute
    if slides.any():
        joint = robot.joint_names[int(np.argmax(slides))]
        raise InputError(f"joint '{joint}' of '{robot.name}' slides without limits; give postures instead")
    return np.where(open_ended, -np.pi, lower), np.where(open_ended, np.pi, upper)
