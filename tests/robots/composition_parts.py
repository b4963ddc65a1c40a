"""The parts that the tests of composition share."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import mujoco
import numpy as np

from jffsr.robots.description import EndEffectorDescription, RobotDescription
from jffsr.robots.geometry import Shape
from jffsr.robots.loading import describe_robot

TWO_ARMS = Path(__file__).parents[1] / "data" / "robots" / "two_arms.yaml"
POSITION = np.array([0.3, -0.5, 0.7])
QUATERNION = np.array([0.8, -0.1, 0.5, 0.4])
INERTIA = np.array([[2.0, 0.1, -0.2], [0.1, 2.5, 0.3], [-0.2, 0.3, 1.8]])


def turn(quaternion) -> np.ndarray:
    """Rotation matrix by MuJoCo."""
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, np.asarray(quaternion) / np.linalg.norm(quaternion))
    return matrix.reshape(3, 3)


def furnished() -> RobotDescription:
    """two_arms with an end effector and a shape on its base and a shape on a hand."""
    whole = describe_robot(TWO_ARMS)
    dock = EndEffectorDescription("dock", "base", np.array([0.2, 0.1, -0.6]), turn([0.6, 0.0, 0.8, 0.0]))
    box = dict(kind="box", size=np.array([0.1, 0.2, 0.3]), rotation=turn([0.9, 0.1, 0.0, 0.3]))
    shapes = (
        Shape("hull", body="base", position=np.array([0.1, 0.0, 0.2]), **box),
        Shape("palm", body="left_hand", position=np.array([0.0, 0.1, 0.0]), **box),
    )
    return dataclasses.replace(whole, end_effectors=(*whole.end_effectors, dock), shapes=shapes)
