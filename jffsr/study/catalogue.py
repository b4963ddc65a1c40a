"""The catalogue of robots as text."""

from __future__ import annotations

import shutil
from collections import Counter
from textwrap import wrap

import numpy as np

from jffsr.clearance.model import ClearanceModel
from jffsr.errors import InputError
from jffsr.robots.builder import build_robot
from jffsr.robots.geometry import COLLISION, VISUAL, Shape
from jffsr.robots.loading import describe_robot, list_robots
from jffsr.robots.robot import PRISMATIC, Robot

_MOST_PAIRS = 15


def catalogue_text(width: int | None = None) -> str:
    """A few lines for each robot of the catalogue: name, joints, masses, what it is, and where it is from.

    No line is longer than `width` letters, that of the terminal for None; 70 at the least.
    """
    width = _width(width)
    names = list_robots()
    column = 2 + max(map(len, names))
    head = f"{'robot':<{column}}{'joints':>6}{'base kg':>9}{'arm kg':>8}"
    indent = " " * (len(head) + 2)
    lines = [f"{head}  description"]
    for name in names:
        description = describe_robot(name)
        robot = build_robot(description)
        base, arm = float(robot.mass[0]), float(np.sum(robot.mass[1:]))
        start = f"{name:<{column}}{robot.num_joints:>6}{base:>9.6g}{arm:>8.4g}  "
        lines += wrap(description.description, width, initial_indent=start, subsequent_indent=indent)
        source = f"source: {description.source}"
        lines += wrap(source, width, initial_indent="  ", subsequent_indent=" " * 4, break_on_hyphens=False)
    return "\n".join(lines)


def robot_text(name: str, width: int | None = None) -> str:
    """One robot in full: sources, notes, bodies, shapes, joints and limits; wrapped like `catalogue_text`."""
    width = _width(width)
    description = describe_robot(name)
    robot = build_robot(description)
    lines = wrap(f"{robot.name}: {description.description}", width, subsequent_indent="  ")
    for title, text in (
        ("also called", ", ".join(description.aliases)),
        ("source", description.source),
        ("licence", description.license),
        ("notes", description.notes),
    ):
        if text:
            lines += wrap(f"{title}: {text}", width, subsequent_indent="  ", break_on_hyphens=False)
    lines += ["", *_bodies(robot)]
    links = [link.name for link in description.links]
    lumped = [link for link in links if link not in robot.body_names]
    if lumped:
        lines += wrap(
            f"lumped into the body that they are fixed to: {', '.join(lumped)}", width, subsequent_indent="  "
        )
    com = ", ".join(f"{x:.4g}" for x in -np.asarray(robot.root_position) + 0.0)
    lines += wrap(
        f"base frame B: at the base's centre of mass, ({com}) m in link '{links[0]}', along its axes", width
    )
    lines += ["", *_joints(robot)]
    lines += wrap(
        "ranges, rates and accelerations in degrees (prismatic: m), torques in N m; inf: none given", width
    )
    lines.append(f"end effectors: {', '.join(robot.end_effector_names) or 'none'}")
    lines += wrap(_kept_apart(robot), width, subsequent_indent="  ")
    return "\n".join(lines)


def _kept_apart(robot: Robot) -> str:
    """Which pairs of bodies a clearance looks at."""
    try:
        pairs = [" and ".join(pair) for pair in ClearanceModel.create(robot).pair_names]
    except InputError:
        return "pairs that constraints.clearance looks at: none"
    more = f", and {len(pairs) - _MOST_PAIRS} more" if len(pairs) > _MOST_PAIRS else ""
    return f"pairs that constraints.clearance looks at: {len(pairs)}: {', '.join(pairs[:_MOST_PAIRS])}{more}"


def _kind(shape: Shape) -> str:
    """A shape's kind, with what it is for where that is one thing alone."""
    use = {(VISUAL,): " to be seen", (COLLISION,): " to be kept clear"}
    return shape.kind + use.get(tuple(shape.roles), "")


def _bodies(robot: Robot) -> list[str]:
    column = 2 + max(len("body"), *map(len, robot.body_names))
    lines = [f"{'body':<{column}}{'mass kg':>10}   {'principal moments kg m^2':<34}shapes"]
    for body, mass, inertia in zip(robot.body_names, robot.mass, robot.inertia, strict=True):
        moments = ", ".join(f"{value:.4g}" for value in np.linalg.eigvalsh(inertia))
        kinds = Counter(_kind(shape) for shape in robot.geometry.on_body(body))
        shapes = ", ".join(kind if count == 1 else f"{count} {kind}" for kind, count in kinds.items())
        lines.append(f"{body:<{column}}{float(mass):>10.6g}   {moments:<34}{shapes or 'none'}")
    lines.append(f"{'in all':<{column}}{float(np.sum(robot.mass)):>10.6g}")
    return lines


def _joints(robot: Robot) -> list[str]:
    limits, column = robot.limits, 2 + max(len("joint"), *map(len, robot.joint_names))
    on = 2 + max(map(len, robot.body_names))
    lines = [f"{'joint':<{column}}{'type':<11}{'on':<{on}}{'range':>16}{'rate':>9}{'accel.':>9}{'torque':>9}"]
    for i, joint in enumerate(robot.joint_names):
        slides = robot.topology.joint_types[i] == PRISMATIC
        turn = 1.0 if slides else 180 / np.pi
        span = f"[{limits.position_lower[i] * turn:.4g}, {limits.position_upper[i] * turn:.4g}]"
        lines.append(
            f"{joint:<{column}}{robot.topology.joint_types[i]:<11}"
            f"{robot.body_names[robot.topology.parents[i]]:<{on}}{span:>16}{limits.velocity[i] * turn:>9.4g}"
            f"{limits.acceleration[i] * turn:>9.4g}{limits.torque[i]:>9.4g}"
        )
    return lines


def _width(width: int | None) -> int:
    return max(70, width if width is not None else shutil.get_terminal_size((100, 24)).columns)
