"""What a joint trajectory is, and what a planner needs of one."""

from __future__ import annotations

from typing import NamedTuple, Protocol, runtime_checkable

from jffsr.types import Array, Scalar, Vector


class Trajectory(Protocol):
    """Any callable of a scalar time, s, that gives joint position, rate and acceleration, (n,) each.

    One that also has `on_grid(times)`, the same for times (G,) with results (n, G), is sampled through that, which
    is faster than one time after another under vmap.
    """

    def __call__(self, time: Scalar) -> tuple[Vector, Vector, Vector]: ...


class Boundary(NamedTuple):
    """What a trajectory is asked for at one end: position, rate and acceleration, (n,) each; None is left free."""

    position: Vector | None
    rate: Vector | None
    acceleration: Vector | None


@runtime_checkable
class PlannedTrajectory(Protocol):
    """A trajectory with boundary conditions that hold exactly and free numbers that a planner may choose.

    `duration` is a scalar, s. `free_bounds` gives lower and upper bounds (k,) of the free numbers, and
    `with_free` a trajectory of the same boundary conditions with those numbers (k,). `boundary` gives these conditions
    at the start and at the end, for the verification.
    """

    duration: Array

    def __call__(self, time: Scalar) -> tuple[Vector, Vector, Vector]: ...

    def boundary(self) -> tuple[Boundary, Boundary]: ...

    def free_bounds(self) -> tuple[Vector, Vector]: ...

    def with_free(self, free: Vector) -> PlannedTrajectory: ...
