"""The replay of a robot's motion: its bodies, where base and tools have been, its momentum and its joints' limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from jffsr.robots.geometry import VISUAL
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.tracking.redundancy import range_share
from jffsr.viz.hold import turned_by
from jffsr.viz.replay.bodies import Part, robot_parts
from jffsr.viz.replay.momenta import momentum_arrows
from jffsr.viz.replay.replay import Axes, Colour, Panel, Replay, Solid, Way
from jffsr.viz.replay.thinning import chosen_samples, frames_each
from jffsr.viz.scene import Scene, scene_of

if TYPE_CHECKING:
    from xarray import Dataset

BASE_WAY: Colour = (0.16, 0.45, 0.85)
TOOL_WAY: Colour = (0.85, 0.33, 0.10)
_STATE = ("base_position", "base_quaternion", "joint_position", "base_twist", "joint_velocity")
_ARROW, _AXES = 0.32, 0.09
"""Lengths of the longest arrow and of a frame's axes, as shares of the robot's size."""


@dataclass
class Extras:
    """What a kind of run adds to a robot's replay; arrays over all samples of the run.

    nearness: of bodies by name, (N,); solids, ways and axes besides the robot's own.
    """

    nearness: dict[str, np.ndarray] = field(default_factory=dict)
    solids: tuple[Solid, ...] = ()
    ways: tuple[Way, ...] = ()
    axes: tuple[tuple[str, np.ndarray, np.ndarray], ...] = ()
    panels: tuple[Panel, ...] = ()
    marks: tuple[tuple[str, float], ...] = ()
    legend: tuple[str, ...] = ()


def robot_replay(
    title: str, robot: Robot, dataset: Dataset, extras: Extras | None = None, together: int = 1
) -> Replay:
    """The replay of a motion, from a dataset with the names of a run's result.nc over `time`.

    together: how many such replays are shown at once.
    """
    extras = extras or Extras()
    time = dataset["time"].values
    chosen = chosen_samples(time, frames_each(together))
    thin = dataset.isel(time=chosen)
    scene = scene_of(robot, thin)
    reach = float(
        np.ptp(scene.segments[0].reshape(-1, 3), axis=0).max()
        + np.ptp(scene.base_faces[0], axis=(0, 1)).max()
    )
    # Above the base, which hides the centre of mass.
    over = scene.com.copy()
    over[:, 2] = scene.base_faces[..., 2].max() + 0.05 * reach
    arrows = momentum_arrows(robot, State(*(thin[name].values for name in _STATE)), over, _ARROW * reach)
    near = joint_nearness(robot, dataset)
    solids = tuple(
        _robot_solids(robot, scene, near[chosen], {k: v[chosen] for k, v in extras.nearness.items()})
    )
    ways = [Way("base's way", scene.base_position, BASE_WAY)]
    ways += [
        Way(f"way of {name}", scene.tools[:, number], TOOL_WAY)
        for number, name in enumerate(robot.end_effector_names)
    ]
    axes = [Axes(name, place[chosen], turn[chosen], _AXES * reach) for name, place, turn in extras.axes]
    axes += [
        Axes(
            f"axes of {name}",
            scene.tools[:, number],
            Rotation.from_matrix(scene.tool_rotation[:, number]).as_quat(scalar_first=True),
            _AXES * reach,
        )
        for number, name in enumerate(robot.end_effector_names)
    ]
    return Replay(
        title=title,
        time=thin["time"].values,
        solids=solids + tuple(thinned(solid, chosen) for solid in extras.solids),
        ways=(*ways, *(Way(w.name, w.points[chosen], w.colour, w.ahead) for w in extras.ways)),
        arrows=arrows,
        axes=tuple(axes),
        panels=(*joint_panels(robot, dataset), base_panel(dataset), *extras.panels),
        marks=extras.marks,
        legend=(limits_in_words(robot), *extras.legend),
    )


def limits_in_words(robot: Robot) -> str:
    """What the colours of joints mean, in one sentence: which of their limits they show."""
    limits = robot.limits
    finite = {
        "position": np.isfinite(limits.position_lower) | np.isfinite(limits.position_upper),
        "rate": np.isfinite(limits.velocity),
    }
    shown = [name for name, has in finite.items() if np.any(has)]
    if not shown:
        return "The joints have no limit of position or rate, so that none of them changes its colour."
    return (
        f"A joint, or the body that it moves, shows its limits of {' and '.join(shown)}: "
        "amber near the nearer one, red at it and beyond."
    )


def thinned(solid: Solid, chosen: np.ndarray) -> Solid:
    """A solid at some of the samples."""
    near = None if solid.nearness is None else solid.nearness[chosen]
    return Solid(
        solid.name,
        solid.vertices,
        solid.faces,
        solid.colour,
        solid.position[chosen],
        solid.quaternion[chosen],
        near,
    )


def joint_nearness(robot: Robot, dataset: Dataset) -> np.ndarray:
    """How near its limits each joint is, (N, n): the larger of its shares of half the range and of the rate limit."""
    share, _ = range_share(robot.limits, dataset["joint_position"].values)
    rate = np.abs(dataset["joint_velocity"].values) / np.asarray(robot.limits.velocity)
    return np.maximum(np.abs(np.asarray(share)), rate)


def joint_panels(robot: Robot, dataset: Dataset) -> tuple[Panel, ...]:
    """Joint positions and rates over time; sliding joints have panels of their own."""
    time, found = dataset["time"].values, []
    turning = robot.topology.is_revolute
    for chosen, scale, unit in ((turning, 180 / np.pi, "deg"), (~turning, 1.0, "m")):
        if not np.any(chosen):
            continue
        for name, title, per in (
            ("joint_position", "joint positions", ""),
            ("joint_velocity", "joint rates", "/s"),
        ):
            values = scale * dataset[name].values[:, chosen]
            curves = _named(np.array(robot.joint_names)[chosen], values)
            found.append(Panel(title, unit + per, time, curves))
    return tuple(found)


def base_panel(dataset: Dataset) -> Panel:
    """How far the base has turned from its start, by its attitude angles where the run has them."""
    time = dataset["time"].values
    if "attitude_angle" in dataset:
        return Panel(
            "base attitude", "deg", time, _named("xyz", np.rad2deg(dataset["attitude_angle"].values))
        )
    turned = np.rad2deg(turned_by(dataset["base_quaternion"].values))
    return Panel("base turned by", "deg", time, {"angle": turned})


def _named(names: Sequence[str], values: np.ndarray) -> dict[str, np.ndarray]:
    return {str(name): curve for name, curve in zip(names, values.T, strict=True)}


def _robot_solids(robot: Robot, scene: Scene, joints: np.ndarray, bodies: dict[str, np.ndarray]):
    for part in robot_parts(robot, scene):
        near = _part_nearness(robot, part, joints, bodies)
        yield Solid(
            part.name,
            part.vertices,
            part.faces,
            part.colour,
            scene.origin[:, part.body],
            Rotation.from_matrix(scene.rotation[:, part.body]).as_quat(scalar_first=True),
            near,
        )


def _part_nearness(
    robot: Robot, part: Part, joints: np.ndarray, bodies: dict[str, np.ndarray]
) -> np.ndarray | None:
    """A housing shows its joint, a body its own; a body of which no housing is drawn shows its joint too."""
    if part.joint is not None:
        return joints[:, part.joint]
    own = bodies.get(robot.body_names[part.body])
    if part.body == 0 or not robot.geometry.on_body(robot.body_names[part.body], VISUAL):
        return own
    joint = joints[:, part.body - 1]
    return joint if own is None else np.maximum(joint, own)
