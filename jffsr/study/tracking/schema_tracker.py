"""The sections `tracker`, `compare` and `tuning`: how the tool is made to follow its path, by what it is judged."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import create_model, model_serializer, model_validator

from jffsr.reading.section import Section
from jffsr.reading.values import choice, conflict, flag, number, sequence, text, whole
from jffsr.study.schema_solver import Optimizer

METHODS = ("inverse", "damped", "manipulability", "adaptive", "transpose")
TASKS = ("base_attitude", "joint_limits", "manipulability")
TUNABLE = ("lambda_max", "epsilon", "damping", "threshold", "position_gain", "attitude_gain")
Positive = Annotated[float, number(gt=0)]
NotNegative = Annotated[float, number(ge=0)]


class Secondary(Section):
    """A task of lower priority in the null space of the tool's."""

    task: Annotated[Literal["base_attitude", "joint_limits", "manipulability"], choice(*TASKS)]
    gain: NotNegative = 0.0
    decoupled: Annotated[bool, flag()] = False  # base_attitude: solved for on its own, then projected

    @model_validator(mode="after")
    def _check(self) -> Secondary:
        if self.decoupled and self.task != "base_attitude":
            raise conflict(
                f"found true, the task '{self.task}' has no such choice, leave it out", "decoupled"
            )
        if self.gain == 0 and self.task != "base_attitude":
            raise conflict(f"found 0, the task '{self.task}' does nothing without a gain > 0", "gain")
        return self


class Tracker(Section):
    """Joint rates from the generalized Jacobian; the names are those of `jffsr.Tracker`."""

    method: Annotated[
        Literal["inverse", "damped", "manipulability", "adaptive", "transpose"], choice(*METHODS)
    ] = "adaptive"
    lambda_max: NotNegative = 0.05  # adaptive
    epsilon: Positive = 0.07  # adaptive
    damping: NotNegative = 0.05  # damped, and the largest of manipulability
    threshold: Positive = 0.05  # manipulability: damped below
    position_gain: NotNegative = 0.0  # 1/s, feedback of the position error
    attitude_gain: NotNegative = 0.0  # 1/s
    period: Annotated[float, number(gt=0, le=1e3, unit="s")] = 0.25
    substeps: Annotated[int, whole(1, 10_000)] = 1  # how often the rates are found anew in a period
    integration_steps: Annotated[int, whole(1, 1000)] = 4  # of the base while rates are held
    feedforward: Annotated[Literal["instant", "mean"], choice("instant", "mean")] = "mean"
    limits: Annotated[
        Literal["ignore", "scale", "redistribute"], choice("ignore", "scale", "redistribute")
    ] = "scale"
    freedom: Annotated[Literal["all", "roll_free", "position"], choice("all", "roll_free", "position")] = (
        "all"
    )
    secondary: Annotated[tuple[Secondary, ...], sequence("a list of at most 3 tasks", 0, 3)] = ()


class _Change(Section):
    """Keys of a tracker that are given, the others being left as they are."""

    @model_serializer(mode="wrap")
    def _without_unused_units(self, handler) -> dict[str, Any]:
        return {key: value for key, value in handler(self).items() if value is not None}


# Every key of a tracker with its own checks, none of them required.
TrackerChange = create_model(
    "TrackerChange",
    __base__=_Change,
    **{
        name: (Annotated[(info.annotation, *info.metadata)] | None, None)
        for name, info in Tracker.model_fields.items()
    },
)
Label = Annotated[str, text(r"[A-Za-z0-9 _,:-]{1,40}", "a label of at most 40 letters and digits")]


class Accuracy(Section):
    """What has to hold on the whole path for a study to be met; null: whatever it is."""

    units: ClassVar = ("attitude", "rate")

    position: Positive | None = None  # largest position error, m
    attitude_deg: Positive | None = None  # largest attitude error
    attitude: Positive | None = None
    rate_deg: Positive | None = None  # largest joint rate, per second
    rate: Positive | None = None

    @model_validator(mode="after")
    def _check(self) -> Accuracy:
        self.check_units()
        return self


Bounds = Annotated[tuple[Positive, ...], sequence("a pair [low, high] of numbers > 0", 2, 2)]


class Tuning(Section):
    """A search for numbers of the tracker, within bounds, by an index over the whole path under a rate limit."""

    units: ClassVar = ("rate_limit",)

    parameters: dict[
        Annotated[str, choice(*TUNABLE)],
        Bounds,
    ]
    index: Annotated[Literal["published", "path_error"], choice("published", "path_error")] = "published"
    rate_limit_deg: Positive | None = None
    rate_limit: Positive | None = None
    weight: Positive = 1.0  # of the relative overrun of the rate limit, m
    radius: Positive = 0.3  # m, path_error: the lever at which a turn counts as a displacement
    optimizer: Optimizer = Optimizer()

    @model_validator(mode="after")
    def _check(self) -> Tuning:
        self.check_units("rate_limit")
        if not self.parameters:
            raise conflict("found none, at least one parameter of the tracker is expected", "parameters")
        for name, (low, high) in self.parameters.items():
            if not low < high:
                raise conflict(f"found [{low:g}, {high:g}], low < high is expected", f"parameters.{name}")
        return self
