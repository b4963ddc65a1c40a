"""The catalogue of robots as text."""

from __future__ import annotations

import numpy as np

from jffsr.robots.builder import build_robot
from jffsr.robots.loading import describe_robot, list_robots
from jffsr.robots.robot import PRISMATIC


def catalogue_text() -> str:
    """A line for each robot of the catalogue: name, joints, masses, and what it is."""
    lines = [f"{'robot':<18}{'joints':>7}{'base kg':>9}{'arm kg':>8}  description"]
    for name in list_robots():
        description = describe_robot(name)
        robot = build_robot(description)
        arm = float(np.sum(robot.mass[1:]))
        lines.append(
            f"{name:<18}{robot.num_joints:>7}{float(robot.mass[0]):>9.6g}{arm:>8.6g}  {description.description}"
        )
        lines.append(f"{'':<18}{'':>7}{'':>9}{'':>8}  source: {description.source}")
    return "\n".join(lines)


def robot_text(name: str) -> str:
    """One robot in full: sources, notes, bodies, joints and limits."""
    description = describe_robot(name)
    robot = build_robot(description)
    lines = [f"{robot.name}: {description.description}"]
    for title, text in (
        ("also called", ", ".join(description.aliases)),
        ("source", description.source),
        ("licence", description.license),
        ("notes", description.notes),
    ):
        if text:
            lines.append(f"{title}: {text}")
    lines += ["", f"{'body':<12}{'mass kg':>10}   principal moments kg m^2"]
    for body, mass, inertia in zip(robot.body_names, robot.mass, robot.inertia, strict=True):
        moments = ", ".join(f"{value:.4g}" for value in np.linalg.eigvalsh(inertia))
        lines.append(f"{body:<12}{float(mass):>10.6g}   {moments}")
    lines += ["", f"{'joint':<12}{'type':<11}{'on':<12}{'range':>20}{'rate':>9}{'accel.':>9}{'torque':>9}"]
    limits = robot.limits
    for i, joint in enumerate(robot.joint_names):
        slides = robot.topology.joint_types[i] == PRISMATIC
        turn = 1.0 if slides else 180 / np.pi
        span = f"[{limits.position_lower[i] * turn:.4g}, {limits.position_upper[i] * turn:.4g}]"
        lines.append(
            f"{joint:<12}{robot.topology.joint_types[i]:<11}{robot.body_names[robot.topology.parents[i]]:<12}"
            f"{span:>20}{limits.velocity[i] * turn:>9.4g}{limits.acceleration[i] * turn:>9.4g}"
            f"{limits.torque[i]:>9.4g}"
        )
    lines.append("ranges, rates and accelerations in degrees (prismatic: m), torques in N m; inf: none given")
    lines.append(f"end effectors: {', '.join(robot.end_effector_names) or 'none'}")
    return "\n".join(lines)
