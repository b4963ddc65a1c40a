"""A target beside a robot: its solids, the grasp frame, and how near bodies come to each other."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from jffsr.robots.geometry import Geometry
from jffsr.robots.robot import Robot
from jffsr.viz.replay.bodies import TARGET, shapes_mesh
from jffsr.viz.replay.curves import positive
from jffsr.viz.replay.of_robot import Extras
from jffsr.viz.replay.replay import Panel, Solid, Way

if TYPE_CHECKING:
    from xarray import Dataset

_TARGET_POINT = (0.75, 0.55, 0.20)
_TRUE_POINT = (0.20, 0.60, 0.35)
_CLOSE = 0.2
"""m beyond the margin, from where on bodies count as near each other."""


def capture_extras(robot: Robot, geometry: Geometry, dataset: Dataset) -> Extras:
    """What a capture's result.nc adds to its robot's replay; geometry holds the target's shapes in its frame."""
    time = dataset["time"].values
    extras = Extras()
    extras.solids = target_solids(
        geometry, dataset["target_position"].values, dataset["target_quaternion"].values
    )
    extras.ways = (Way("grasp point's way", dataset["grasp_position"].values, _TARGET_POINT),)
    extras.axes = (("grasp frame", dataset["grasp_position"].values, dataset["grasp_quaternion"].values),)
    curves = _off(dataset["grasp_error"].values)
    words: tuple[str, ...] = ()
    if "true_grasp_error" in dataset:
        curves = {f"{name}, predicted": values for name, values in curves.items()}
        curves |= {
            f"{name}, true": values for name, values in _off(dataset["true_grasp_error"].values).items()
        }
        extras.ways += (Way("true grasp point's way", dataset["true_grasp_position"].values, _TRUE_POINT),)
        words = (
            "The target is where it really is; the grasp frame, and the yellow way, are where the filter predicts it, "
            "the green way is the true grasp point's.",
        )
    extras.panels = (Panel("tool from the grasp", "m, rad", time, curves, logarithmic=True),)
    if "clearance" in dataset:
        margin = float(dataset.attrs.get("margin", 0.0))
        apart, pairs = dataset["clearance"].values, [str(pair) for pair in dataset["pair"].values]
        nearest = apart.min(axis=0)
        extras.panels += (Panel("nearest two bodies", "m", time, {"clearance": nearest}, bounds=(margin,)),)
        near = np.clip(1.0 - (apart - margin) / _CLOSE, 0.0, None)
        for body in (*robot.body_names, "target"):
            own = [number for number, pair in enumerate(pairs) if body in pair.split(" and ")]
            if own:
                extras.nearness[body] = near[own].max(axis=0)
        words += (
            f"Bodies and target show how near they come to each other: red at {margin:g} m, the margin between them.",
        )
        if "target" in extras.nearness:
            extras.solids = tuple(
                replace(solid, nearness=extras.nearness["target"]) for solid in extras.solids
            )
    extras.legend = words
    return extras


def _off(error: np.ndarray) -> dict[str, np.ndarray]:
    """Lengths over time of an error (N, 12) of the tool's pose: position, m, and attitude, rad."""
    return {
        "position": positive(np.linalg.norm(error[:, :3], axis=1)),
        "attitude": positive(np.linalg.norm(error[:, 3:6], axis=1)),
    }


def target_solids(geometry: Geometry, position: np.ndarray, quaternion: np.ndarray) -> tuple[Solid, ...]:
    """The target's shapes along position (N, 3), m, and quaternion (N, 4), w first."""
    meshes = shapes_mesh(geometry, TARGET)
    return tuple(
        Solid("target" if not number else f"target {number + 1}", *mesh, colour, position, quaternion)
        for number, (colour, mesh) in enumerate(meshes.items())
    )
