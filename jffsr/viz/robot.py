"""One robot standing still: its shapes as shaded solids, its joints by name, its tools, its centre of mass."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from jffsr.errors import InputError
from jffsr.robots.geometry import MESH, VISUAL
from jffsr.robots.robot import Robot
from jffsr.viz.labels import draw_labels, label_widths
from jffsr.viz.replay.bodies import BASE, LINKS, bare_parts
from jffsr.viz.scene import Scene, scene_at
from jffsr.viz.solids import outward, refined, shape_faces
from jffsr.viz.style import COLOURS, legend_above, new_figure, styled
from jffsr.viz.view import across_view, fill, flatten, frame_plane, frame_space, viewpoint

_WIDTH = 4.6  # in
_TALLEST = 3.9
_FOLDED = 0.35  # of the arm's length: a tool nearer to the arm's root than that is folded in
_BASE = (0.82, 0.83, 0.86, 1.0)
_LINKS = ((0.53, 0.67, 0.83, 1.0), (0.86, 0.89, 0.93, 1.0))  # in turn, so that neighbours differ
_JOINT = {"color": COLOURS[5], "linewidth": 1.1}
_COM = {"color": COLOURS[0], "linestyle": "none", "marker": "o", "markersize": 5.5, "fillstyle": "none"}
_TOOL_AXES = (COLOURS[2], COLOURS[3], COLOURS[1])


class _Sorted(PolyCollection):
    """Faces that lie on the page and in order already, where axes in three dimensions would sort again."""

    def do_3d_projection(self) -> float:
        return 0.0


@dataclass(frozen=True)
class Still:
    """A drawing of a robot, and the posture (n,), rad and m, that it is drawn in."""

    figure: Figure
    posture: np.ndarray


@styled
def draw_still(robot: Robot, joint_position: np.ndarray | None = None) -> Still:
    """A robot in the posture joint_position (n,), rad and m, its base at the origin with the axes of I.

    None is zero, or the middle of its range for a joint that cannot be there; where that folds the arm
    together, one or two joints are turned by right angles, those that take the tools farthest from the base.
    Every body is drawn by the shapes that its file gives it to be seen, or as in a replay by those made from masses
    and inertias (`bare_parts`). A planar robot is drawn from above, any other in three dimensions; all axes have one
    scale. Raises InputError for a posture of another shape
    or with numbers that are not finite.
    """
    if joint_position is None:
        postures = _likely_postures(robot)
        scene = scene_at(robot, postures)
        sample = _least_folded(scene)
    else:
        postures, sample = np.asarray(joint_position, float)[None], 0
        if postures.shape != (1, robot.num_joints) or not np.all(np.isfinite(postures)):
            raise InputError(
                f"robot '{robot.name}': found {postures[0].size} joint positions {postures[0].tolist()}, "
                f"{robot.num_joints} finite numbers are needed"
            )
        scene = scene_at(robot, postures)
    return Still(_draw(robot, scene, sample), postures[sample])


def _likely_postures(robot: Robot) -> np.ndarray:
    """Zero or mid-range, then the same with one or two revolute joints turned by right angles, in limits."""
    low, high = np.asarray(robot.limits.position_lower), np.asarray(robot.limits.position_upper)
    finite = np.isfinite(low) & np.isfinite(high)
    middle = 0.5 * (np.where(finite, low, 0.0) + np.where(finite, high, 0.0))
    # A joint at the very end of its range shows little of how it moves.
    home = np.where(finite & ((low >= 0) | (high <= 0)), middle, np.clip(0.0, low, high))
    turns = []
    for joint in np.flatnonzero(robot.topology.is_revolute):
        for angle in (0.5 * np.pi, -0.5 * np.pi):
            turn = angle * (np.arange(robot.num_joints) == joint)
            if low[joint] <= home[joint] + angle <= high[joint]:
                turns.append(turn)
    pairs = [one + other for one, other in combinations(turns, 2) if not np.any(one * other)]
    return home + np.stack([np.zeros_like(home), *turns, *pairs])


def _least_folded(scene: Scene) -> int:
    """The first sample, or where its tools are near the arm's root the one with the tools farthest out."""
    lengths = np.linalg.norm(scene.segments[0, :, 1] - scene.segments[0, :, 0], axis=1)
    reach = np.linalg.norm(scene.tools[0] - scene.joints[0, 0], axis=1)
    tools = scene.tools.shape[1]
    if np.all(reach > _FOLDED * lengths[scene.owners > 0].sum() / tools):
        return 0
    return int(np.argmax(np.linalg.norm(scene.tools - scene.base_position[:, None], axis=2).sum(axis=1)))


def _draw(robot: Robot, scene: Scene, sample: int) -> Figure:
    joints, tools, com = scene.joints[sample], scene.tools[sample], scene.com[sample]
    solids = solids_of(robot, scene, sample)
    points = np.concatenate([faces.reshape(-1, 3) for faces, *_ in solids])
    reach = np.ptp(points, axis=0).max()
    arm = max(np.ptp(np.concatenate([joints, tools]), axis=0).max(), 0.2 * reach)
    axes_ends = joints + np.multiply.outer([-1.0, 1.0], 0.055 * arm * scene.joint_axes[sample])
    frames = np.swapaxes(scene.tool_rotation[sample], -1, -2)
    tool_ends = tools[: len(frames), None] + 0.13 * arm * frames
    points = np.concatenate([points, axes_ends.reshape(-1, 3), tool_ends.reshape(-1, 3)])
    low, high = points.min(axis=0) - 0.03 * reach, points.max(axis=0) + 0.03 * reach

    figure = new_figure(_WIDTH, width=_WIDTH)
    size = 2 if scene.planar else 3
    if scene.planar:
        towards, span = np.array([0.0, 0.0, 1.0]), high - low
        figure.set_figheight(float(np.clip((_WIDTH - 0.6) * span[1] / span[0], 0.9, _TALLEST)) + 0.95)
        axes = figure.subplots()
        frame_plane(axes, low, high)
    else:
        axes = figure.add_subplot(projection="3d", computed_zorder=False)
        azimuth = viewpoint(scene.segments[sample], scene.base_position[sample])
        towards = frame_space(axes, low, high, azimuth, labelpad=-4)
    draw_solids(axes, solids, towards, 0.02 * reach, size)
    for ends in np.swapaxes(axes_ends, 0, 1):
        axes.plot(*ends.T[:size], **_JOINT, zorder=5, solid_capstyle="round")
    axes.plot(*joints.T[:size], **_JOINT, linestyle="none", marker="o", markersize=2.6, zorder=6)
    for tool, ends in zip(tools, tool_ends, strict=False):
        for end, colour in zip(ends[:size], _TOOL_AXES, strict=False):
            axes.plot(*np.stack([tool, end]).T[:size], color=colour, linewidth=1.3, zorder=7)
    for marker in "o+":
        axes.plot(*com[:size, None], **{**_COM, "marker": marker}, zorder=8)

    handles, labels = _legend(size if len(frames) else 0)
    legend = legend_above(figure, handles, labels, title=_title(robot))
    names = list(robot.joint_names)
    if size == 3:
        fill(figure, axes, legend, _TALLEST, label_widths(figure, axes, names, joints), close=True)
    draw_labels(figure, axes, names, joints)
    return figure


def _title(robot: Robot) -> str:
    base, arm = float(robot.mass[0]), float(np.sum(robot.mass[1:]))
    return f"{robot.name}: base {base:.6g} kg, arm {arm:.4g} kg"


def _legend(tool_axes: int) -> tuple[list[Line2D], list[str]]:
    handles = [Line2D([], [], **_JOINT, marker="o", markersize=2.6)]
    handles += [Line2D([], [], color=colour, linewidth=1.3) for colour in _TOOL_AXES[:tool_axes]]
    labels = ["joint and axis", "tool x", "y", "z"][: 1 + tool_axes]
    handles.append(Line2D([], [], **_COM))
    return handles, [*labels, "centre of mass"]


def solids_of(robot: Robot, scene: Scene, sample: int) -> list[tuple[np.ndarray, tuple, bool, bool]]:
    """One entry a shape: faces (f, 4, 3) in I, colour, whether no back can be seen, whether on the base."""
    found = []
    for body, name in enumerate(robot.body_names):
        for shape in robot.geometry.on_body(name, VISUAL):
            faces = shape_faces(shape) @ scene.rotation[sample, body].T + scene.origin[sample, body]
            found.append((faces, shape.colour or _colour(body), shape.kind != MESH, body == 0))
    for part in bare_parts(robot, scene):
        faces = part.faces @ scene.rotation[sample, part.body].T + scene.origin[sample, part.body]
        # On paper bodies are a little lighter than on a screen.
        colour = _colour(part.body) if part.colour in (BASE, *LINKS) else part.colour
        # Of a base without extent along some axis the box has no inside.
        is_closed = part.name != robot.body_names[0]
        found.append((faces, colour, is_closed, part.body == 0))
    return found


def _colour(body: int) -> tuple:
    return _BASE if body == 0 else _LINKS[body % 2]


def draw_solids(axes, solids: list, towards: np.ndarray, longest: float, size: int) -> None:
    """All faces of `solids_of`, small, from the farthest to the nearest, in axes that show two dimensions or three."""
    if size == 3:
        right, up = across_view(towards)
        light = towards + 0.8 * up - 0.5 * right
    else:
        light = np.array([-0.3, 0.5, 1.0])
    light = light / np.linalg.norm(light)
    hull = max(
        (np.ptp(faces.reshape(-1, 3), axis=0).max() for faces, *_, base in solids if base), default=0.0
    )
    drawn, colours, depths = [], [], []
    for faces, colour, closed, base in solids:
        small = refined(faces, longest)
        normals = outward(small)
        facing = normals @ towards
        if closed:
            seen = facing > 0
            small, normals = small[seen], normals[seen]
        else:
            # Whatever way round a mesh has its corners, the side that is seen is the one that is lit.
            normals = normals * np.where(facing < 0, -1.0, 1.0)[:, None]
        bright = 0.58 + 0.42 * np.clip(normals @ light, 0.0, 1.0)
        rgba = np.tile(to_rgba(colour), (len(small), 1))
        rgba[:, :3] *= bright[:, None]
        drawn.append(small)
        colours.append(rgba)
        # What stands on the base touches its faces and must not be cut by the half of one that lies before.
        back = 0.7 * longest if base and np.ptp(faces.reshape(-1, 3), axis=0).max() > 0.4 * hull else 0.0
        depths.append(small.mean(axis=1) @ towards - back)
    faces, rgba = np.concatenate(drawn), np.concatenate(colours)
    order = np.argsort(np.concatenate(depths), kind="stable")
    faces, rgba = faces[order], rgba[order]
    flat = faces[..., :2] if size == 2 else flatten(axes, faces)
    style = {"facecolors": rgba, "edgecolors": rgba, "linewidths": 0.4, "zorder": 2}
    axes.add_collection(_Sorted(flat, **style), autolim=False)
