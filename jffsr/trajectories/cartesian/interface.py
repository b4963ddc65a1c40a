"""What a tool's path is, what its timing is, and what the two together ask of the tool at a time."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from jffsr.types import Array, Quaternion, Scalar, Twist, Vector3


class ToolPath(Protocol):
    """Any callable of a path parameter s in [0, 1] that gives position (3,), m, and attitude quaternion (4,) in I."""

    def __call__(self, s: Scalar) -> tuple[Vector3, Quaternion]: ...


class Timing(Protocol):
    """How far along its path the tool is at a time: s from 0 to 1 over `duration`, s, with its two derivatives."""

    duration: Array

    def __call__(self, time: Scalar) -> tuple[Scalar, Scalar, Scalar]: ...


class ToolTarget(NamedTuple):
    """What the tool should do at a time: position (3,), m; quaternion (4,); twist (6,), [linear; angular], and its
    derivative (6,), all in I."""

    position: Vector3
    quaternion: Quaternion
    twist: Twist
    acceleration: Twist
