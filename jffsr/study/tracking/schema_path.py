"""The sections `path` and `timing`: where the tool goes, and how fast."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import model_validator

from jffsr.reading.section import Section
from jffsr.reading.values import choice, conflict, number, sequence, text, whole
from jffsr.study.schema_task import Number, Seconds, Vector3

LINE, WAYPOINTS, ARC, SPLINE, CALL = "line", "waypoints", "arc", "spline", "call"
_OF_PATH = {  # the keys that each kind of path knows beside those of all
    LINE: ("poses",),
    WAYPOINTS: ("poses", "blend_share", "blend_radius", "metres_per_radian"),
    ARC: ("poses", "via", "attitude"),
    SPLINE: ("poses", "degree", "metres_per_radian"),
    CALL: ("call",),
}
_DEFAULTS = {
    WAYPOINTS: {"blend_share": 0.5, "metres_per_radian": 1.0},
    ARC: {"attitude": "to_goal"},
    SPLINE: {"degree": 3, "metres_per_radian": 1.0},
}
_LEAST_POSES = {LINE: 2, WAYPOINTS: 2, ARC: 2, SPLINE: 4}
_SIZES = {LINE: "2", ARC: "2 (start and goal)"}
Positive = Annotated[float, number(gt=0)]
# Its length is looked at by the path, which refuses what is not unit.
Quaternion = Annotated[tuple[Number, ...], sequence("a list of 4 numbers (w, x, y, z)", 4, 4)]
Angles = Annotated[tuple[Number, ...], sequence("a list of 3 angles", 3, 3)]


Order = Annotated[
    str,
    text(
        r"-?(?!.?(.)\1)(?:[XYZ]{3}|[xyz]{3})",
        "three axes such as 'ZYX' (turning axes), 'xyz' (fixed axes) or '-xyz' (signs turned)",
    ),
]


class Pose(Section):
    """A tool pose in I: a position, m, and a quaternion, or angles in the path's order."""

    units: ClassVar = ("angles",)

    position: Vector3
    quaternion: Quaternion | None = None
    angles_deg: Angles | None = None
    angles: Angles | None = None

    @model_validator(mode="after")
    def _check(self) -> Pose:
        self.check_units()
        given = [key for key in ("quaternion", "angles_deg", "angles") if getattr(self, key) is not None]
        if len(given) != 1:
            raise conflict(
                f"found {' and '.join(given) or 'no attitude'}, either 'quaternion' or 'angles_deg' (or 'angles') is "
                "expected",
                given[-1] if given else "quaternion",
            )
        return self

    @property
    def attitude(self) -> tuple[float, ...]:
        """Quaternion (4,), or angles (3,), rad."""
        return self.si("angles") if self.quaternion is None else self.quaternion


class StartTolerance(Section):
    """How far the path's first pose may lie from where the tool is."""

    units: ClassVar = ("attitude",)

    position: Positive = 0.01  # m
    attitude_deg: Positive | None = None
    attitude: Positive | None = None

    @model_validator(mode="before")
    @classmethod
    def _default(cls, value):
        if isinstance(value, dict) and value.get("attitude") is None and value.get("attitude_deg") is None:
            return {**value, "attitude_deg": 1.0}
        return value

    @model_validator(mode="after")
    def _check(self) -> StartTolerance:
        self.check_units()
        return self


class Path(Section):
    """The tool's path through poses, the first of which is its start.

    start: with `actual` the path begins where the tool is, which has to be within start_tolerance of the first pose;
    with `given` it begins at the first pose, and the tool that far beside it.
    """

    kind: Annotated[
        Literal["line", "waypoints", "arc", "spline", "call"], choice(LINE, WAYPOINTS, ARC, SPLINE, CALL)
    ] = LINE
    start: Annotated[Literal["actual", "given"], choice("actual", "given")] = "actual"
    start_tolerance: StartTolerance = StartTolerance(attitude_deg=1.0)
    order: Order | None = None  # of angles
    poses: Annotated[tuple[Pose, ...], sequence("a list of 2 to 1000 poses", 2, 1000)] | None = None
    via: Vector3 | None = None  # arc: a position between start and goal
    attitude: (
        Annotated[Literal["fixed", "turning", "to_goal"], choice("fixed", "turning", "to_goal")] | None
    ) = None  # arc
    degree: Annotated[int, whole(3, 20)] | None = None  # spline
    blend_share: Annotated[float, number(gt=0, le=1)] | None = None  # waypoints
    blend_radius: Positive | None = None  # waypoints, m; null: none
    metres_per_radian: Positive | None = None  # waypoints and spline: what a turn counts as
    call: Annotated[str, text(r"[A-Za-z_][\w.]*\.[A-Za-z_]\w*", "module.function of s in [0, 1]")] | None = (
        None
    )

    @model_validator(mode="before")
    @classmethod
    def _default(cls, value):
        # Written out, so that a resolved configuration shows what the path uses.
        if not isinstance(value, dict) or not isinstance(value.get("kind", LINE), str):
            return value
        own = _DEFAULTS.get(value.get("kind", LINE), {})
        return {**value, **{key: default for key, default in own.items() if value.get(key) is None}}

    @model_validator(mode="after")
    def _check(self) -> Path:
        for key in {key for keys in _OF_PATH.values() for key in keys} - set(_OF_PATH[self.kind]):
            if getattr(self, key) is not None:
                raise conflict(f"the path '{self.kind}' has no such key, leave it out", key)
        if self.kind == CALL:
            if self.call is None:
                raise conflict("missing, module.function of s in [0, 1] is required", "call")
            return self
        if self.poses is None:
            raise conflict("missing, a list of poses is required", "poses")
        self._check_poses()
        if self.kind == ARC and self.via is None:
            raise conflict("missing, a position between start and goal is required", "via")
        return self

    def _check_poses(self) -> None:
        count, least = len(self.poses), _LEAST_POSES[self.kind]
        if self.kind == SPLINE:
            least = self.degree + 1
        exact = self.kind in _SIZES
        if count < least or (exact and count != least):
            wanted = _SIZES.get(self.kind, f"at least {least}")
            raise conflict(f"found {count} poses, {wanted} are expected", "poses")
        angles = [pose.quaternion is None for pose in self.poses]
        if any(angles) and not all(angles):
            raise conflict("found quaternions and angles, the same for all poses is expected", "poses")
        if any(angles) and self.order is None:
            raise conflict("missing, poses with angles need an order such as 'ZYX'", "order")
        if not any(angles) and self.order is not None:
            raise conflict(
                f"found '{self.order}', poses with quaternions have no order, leave it out", "order"
            )


TRAPEZOID, QUINTIC, FASTEST = "trapezoid", "quintic", "fastest"
_OF_TIMING = {  # the keys that each kind of timing knows, with their defaults; None is required
    TRAPEZOID: {"duration": None, "ramp_fraction": 0.2},
    QUINTIC: {"duration": None},
    FASTEST: {"margin": 0.02},
}


class Timing(Section):
    """How the tool goes along its path; `fastest`: as the robot's limits of rate and acceleration allow."""

    kind: Annotated[Literal["trapezoid", "quintic", "fastest"], choice(TRAPEZOID, QUINTIC, FASTEST)] = (
        TRAPEZOID
    )
    duration: Seconds | None = None
    ramp_fraction: Annotated[float, number(gt=0, le=0.5)] | None = None  # trapezoid
    margin: Annotated[float, number(ge=0, lt=1)] | None = None  # fastest: share of the limits that is spared

    @model_validator(mode="before")
    @classmethod
    def _default(cls, value):
        if not isinstance(value, dict) or not isinstance(value.get("kind", TRAPEZOID), str):
            return value
        own = _OF_TIMING.get(value.get("kind", TRAPEZOID), {})
        return {**value, **{key: default for key, default in own.items() if value.get(key) is None}}

    @model_validator(mode="after")
    def _check(self) -> Timing:
        own = _OF_TIMING[self.kind]
        if "duration" in own and self.duration is None:
            raise conflict("missing, a duration in s is required", "duration")
        for key in ("duration", "ramp_fraction", "margin"):
            if key not in own and getattr(self, key) is not None:
                raise conflict(f"the timing '{self.kind}' has no such key, leave it out", key)
        return self
