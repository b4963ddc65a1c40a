"""A capability map as a slice through it and in space, with the arm that it belongs to."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure

from jffsr.capture.capability_map import CapabilityMap
from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.viz.robot import draw_solids, solids_of
from jffsr.viz.save import KINDS, save_figure
from jffsr.viz.scene import Scene, scene_at
from jffsr.viz.style import COLOURS, new_figure, styled
from jffsr.viz.view import frame_space, viewpoint

_COLOURS = "viridis"
_LABEL = "share of poses reached [-]"
_WIDTH = 4.6  # in
_ARM = {"color": "white", "linewidth": 2.6, "solid_capstyle": "round"}
_ARM_LINE = {"color": COLOURS[0], "linewidth": 1.1, "solid_capstyle": "round"}
_TOOL = {"color": COLOURS[2], "linestyle": "none", "marker": "o", "markersize": 4}


@styled
def draw_capability_slice(
    capability: CapabilityMap,
    normal: str = "y",
    at: float | None = None,
    robot: Robot | None = None,
    joint_position: np.ndarray | None = None,
) -> Figure:
    """Contours of the share over a plane of the base frame, across its axis `normal` (x, y or z) at `at`, m.

    None for `at` is the middle of the map. With a robot its base and arm are drawn over it, seen along that axis, in
    the posture joint_position (n,), rad and m, zero by default. Raises InputError for another axis and a plane that
    does not cross the map.
    """
    if normal not in ("x", "y", "z"):
        raise InputError(f"capability slice: normal is {normal!r}; allowed are x, y, z")
    k = "xyz".index(normal)
    across, up = (j for j in range(3) if j != k)
    axis, half = capability.axes[k], 0.5 * float(capability.spacing)
    at = float(0.5 * (axis[0] + axis[-1])) if at is None else float(at)
    if not axis[0] - half <= at <= axis[-1] + half:
        raise InputError(
            f"capability slice: {normal} = {at:g} m does not cross the map, which goes from {axis[0]:.4g} to "
            f"{axis[-1]:.4g} m"
        )
    values = _plane(np.asarray(capability.share), axis, k, at)
    x, y = capability.axes[across], capability.axes[up]
    figure = new_figure(_WIDTH * min(1.3, max(0.5, np.ptp(y) / np.ptp(x))) * 0.8, width=_WIDTH)
    axes = figure.subplots()
    # Nothing is filled where next to nothing is reached.
    levels = np.concatenate([[0.02], np.linspace(0.1, 1, 10)])
    drawn = axes.contourf(x, y, values.T, levels=levels, cmap=_COLOURS, vmin=0, vmax=1)
    axes.contour(x, y, values.T, levels=levels[1:-1], colors="white", linewidths=0.3)
    if robot is not None:
        _draw_arm(axes, _scene(robot, joint_position), across, up)
    axes.set_aspect("equal")
    axes.set_xlabel(f"{'xyz'[across]} [m]")
    axes.set_ylabel(f"{'xyz'[up]} [m]")
    axes.set_title(f"{capability.robot}: {normal} = {at:.3g} m in the base frame")
    figure.colorbar(drawn, ax=axes, label=_LABEL, ticks=np.linspace(0.2, 1, 5))
    return figure


def _plane(share: np.ndarray, axis: np.ndarray, k: int, at: float) -> np.ndarray:
    """The shares over the plane, linear between the layers beside it."""
    if len(axis) == 1:
        return np.take(share, 0, axis=k)
    place = np.clip((at - axis[0]) / (axis[1] - axis[0]), 0, len(axis) - 1)
    below = min(int(place), len(axis) - 2)
    rest = place - below
    return (1 - rest) * np.take(share, below, axis=k) + rest * np.take(share, below + 1, axis=k)


def _scene(robot: Robot, joint_position: np.ndarray | None) -> Scene:
    posture = np.zeros(robot.num_joints) if joint_position is None else np.asarray(joint_position, float)
    if posture.shape != (robot.num_joints,):
        raise InputError(
            f"robot '{robot.name}': found {posture.size} joint positions, {robot.num_joints} are needed"
        )
    return scene_at(robot, posture[None])


def _draw_arm(axes, scene: Scene, across: int, up: int) -> None:
    """Outline of the base's box and the links as lines, seen along the third axis."""
    for face in scene.base_faces[0]:
        closed = np.concatenate([face, face[:1]])
        axes.plot(closed[:, across], closed[:, up], color="0.35", linewidth=0.6)
    for look in (_ARM, _ARM_LINE):
        for ends in scene.segments[0]:
            axes.plot(ends[:, across], ends[:, up], **look)
    axes.plot(scene.tools[0][:, across], scene.tools[0][:, up], **_TOOL)


@styled
def draw_capability_space(
    capability: CapabilityMap,
    robot: Robot,
    joint_position: np.ndarray | None = None,
    least: float = 0.05,
) -> Figure:
    """The far half of the map in three dimensions, its cells coloured by share, behind the arm and its base.

    The cut goes through the first joint, across the view; cells of less than `least` are left out. The robot stands in
    the posture joint_position (n,), rad and m, zero by default.
    """
    scene = _scene(robot, joint_position)
    solids = solids_of(robot, scene, 0)
    share = np.asarray(capability.share)
    points = np.stack(np.meshgrid(*capability.axes, indexing="ij"), axis=-1)
    anchor = scene.joints[0, 0]
    figure = new_figure(3.9, width=_WIDTH)
    axes = figure.add_subplot(projection="3d", computed_zorder=False)
    filled = points[share >= least]
    corners = np.concatenate([filled, *(faces.reshape(-1, 3) for faces, *_ in solids)])
    low, high = corners.min(axis=0), corners.max(axis=0)
    azimuth = viewpoint(scene.segments[0], scene.base_position[0])
    towards = frame_space(axes, low, high, azimuth, labelpad=-4)
    across = np.array([towards[0], towards[1], 0.0])
    shown = (share >= least) & ((points - anchor) @ across < 0)
    cells, values = points[shown], share[shown]
    order = np.argsort(cells @ towards)
    norm = BoundaryNorm(np.linspace(0, 1, 11), 256)
    # As wide as a cell on the page, so that the cut is nearly closed.
    size = 0.85 * 72 * 2.6 * float(capability.spacing) / np.linalg.norm(high - low)
    dots = axes.scatter(
        *cells[order].T,
        c=values[order],
        cmap=_COLOURS,
        norm=norm,
        s=size**2,
        marker="s",
        linewidths=0,
        zorder=1,
        depthshade=False,
    )
    draw_solids(axes, solids, towards, 0.02 * np.ptp(corners, axis=0).max(), 3)
    figure.set_layout_engine("none")
    axes.set_position((0.06, -0.02, 0.72, 1.0))
    figure.suptitle(
        f"{capability.robot}: the far half of the map, cells of {1e2 * float(capability.spacing):.3g} cm",
        y=0.96,
        fontsize=8,
    )
    bar = figure.add_axes((0.86, 0.22, 0.025, 0.52))
    figure.colorbar(dots, cax=bar, label=_LABEL, ticks=np.linspace(0, 1, 6))
    return figure


def save_map_figures(
    capability: CapabilityMap, robot: Robot, stem: Path, kinds: Sequence[str] = KINDS[:1]
) -> list[Path]:
    """Write slices through the first joint, and the view in space where there is more than a layer, to `stem`_....

    The arm is drawn at joint positions zero. The paths of the files.
    """
    joint = _scene(robot, None).joints[0, 0]
    flat = [k for k in range(3) if capability.share.shape[k] == 1]
    normals = "".join("xyz"[k] for k in flat) or "yz"
    figures = {
        f"{normal}_slice": draw_capability_slice(
            capability, normal, None if flat else joint["xyz".index(normal)], robot
        )
        for normal in normals
    }
    if not flat:
        figures["space"] = draw_capability_space(capability, robot)
    return [
        path
        for name, figure in figures.items()
        for path in save_figure(figure, stem.with_name(f"{stem.name}_{name}"), kinds)
    ]
