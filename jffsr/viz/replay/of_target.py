"""A target beside a robot: its solids, the grasp frame, and how near bodies come to each other."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from jffsr.robots.geometry import Geometry
from jffsr.viz.replay.apart import add_clearance
from jffsr.viz.replay.bodies import TARGET, shapes_mesh
from jffsr.viz.replay.curves import positive
from jffsr.viz.replay.of_robot import Extras
from jffsr.viz.replay.replay import Panel, Solid, Way

if TYPE_CHECKING:
    from xarray import Dataset

_TARGET_POINT = (0.75, 0.55, 0.20)
_TRUE_POINT = (0.20, 0.60, 0.35)


def capture_extras(geometry: Geometry, dataset: Dataset) -> Extras:
    """What a capture's result.nc adds to its robot's replay; geometry holds the target's shapes in its frame."""
    time = dataset["time"].values
    extras = Extras()
    extras.solids = target_solids(
        geometry, dataset["target_position"].values, dataset["target_quaternion"].values
    )
    extras.ways = (Way("grasp point's way", dataset["grasp_position"].values, _TARGET_POINT),)
    extras.axes = (("grasp frame", dataset["grasp_position"].values, dataset["grasp_quaternion"].values),)
    curves = _off(dataset["grasp_error"].values)
    if "true_grasp_error" in dataset:
        curves = {f"{name}, predicted": values for name, values in curves.items()}
        curves |= {
            f"{name}, true": values for name, values in _off(dataset["true_grasp_error"].values).items()
        }
        extras.ways += (Way("true grasp point's way", dataset["true_grasp_position"].values, _TRUE_POINT),)
        extras.legend = (
            "The target is where it really is; the grasp frame, and the yellow way, are where the filter predicts it, "
            "the green way is the true grasp point's.",
        )
    extras.panels = (Panel("tool from the grasp", "m, rad", time, curves, logarithmic=True),)
    if "clearance" in dataset:
        margin = float(dataset.attrs.get("margin", 0.0))
        pairs = [tuple(str(pair).split(" and ")) for pair in dataset["pair"].values]
        add_clearance(extras, time, dataset["clearance"].values, pairs, margin, "Bodies and target show")
        if "target" in extras.nearness:
            extras.solids = tuple(
                replace(solid, nearness=extras.nearness["target"]) for solid in extras.solids
            )
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
