"""Joint laws and robots that several tests share."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import numpy as np

from jffsr.robots.builder import build_robot
from jffsr.robots.description import (
    EndEffectorDescription,
    JointDescription,
    LinkDescription,
    RobotDescription,
)
from jffsr.robots.robot import Robot


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Quintic:
    """q0 + (qf - q0)(10 s^3 - 15 s^4 + 6 s^5), s = t/duration: rest to rest, written out for the tests."""

    start: jax.Array
    goal: jax.Array
    duration: jax.Array

    def __call__(self, time):
        s, change, duration = time / self.duration, self.goal - self.start, self.duration
        return (
            self.start + change * s**3 * (10 - 15 * s + 6 * s**2),
            change * 30 * s**2 * (1 - s) ** 2 / duration,
            change * 60 * s * (1 - s) * (1 - 2 * s) / duration**2,
        )


def robot_from_record(record: dict) -> Robot:
    """The robot that an oracle file describes."""
    names = [link["name"] for link in record["links"]]
    return build_robot(
        RobotDescription(
            name=record["name"],
            origin=f"oracle robot '{record['name']}'",
            links=tuple(
                LinkDescription(
                    link["name"], link["mass"], np.array(link["com"]), np.array(link["inertia_com"])
                )
                for link in record["links"]
            ),
            joints=tuple(
                JointDescription(
                    name=joint["name"],
                    type=joint["type"],
                    parent=names[joint["parent_link"]],
                    child=names[joint["child_link"]],
                    position=np.array(joint["origin_xyz"]),
                    rotation=np.array(joint["origin_R"]),
                    axis=np.array(joint["axis"]),
                )
                for joint in record["joints"]
            ),
            end_effectors=tuple(
                EndEffectorDescription(
                    tool["name"],
                    names[tool["link"]],
                    np.array(tool["origin_xyz"]),
                    np.array(tool["origin_R"]),
                )
                for tool in record["end_effectors"]
            ),
        )
    )
