"""The grasp-time criterion over time, with the windows in which grasping is possible and the time that was chosen."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from jffsr.capture.grasp_time import GraspTime
from jffsr.viz.style import COLOURS, SHADE, legend_above, level_look, new_figure, styled

_CHOSEN = {"color": COLOURS[0], "linestyle": "none", "marker": "o", "markersize": 4.5}
_MINIMUM = {"color": COLOURS[0], "linestyle": "none", "marker": "o", "markersize": 4.5, "fillstyle": "none"}
_GRASPED = {"color": COLOURS[2], "linewidth": 0.9, "linestyle": (0, (1, 1))}
_FAINT = 0.35


@styled
def draw_grasp_time(found: GraspTime, grasped: float | None = None) -> Figure:
    """Panels over time for each grasp frame: the criterion, the angle of approach and, with a map, its share.

    Stretches in which no frame can be grasped are shaded; curves are faint where their own frame cannot. Local minima
    are open circles, the chosen one is filled. grasped, s, is where a plan ends.
    """
    scans = found.scans
    has_map = any(np.any(scan.share) for scan in scans)
    figure = new_figure(3.9 if has_map else 3.0)
    panels = figure.subplots(2 + has_map, sharex=True, height_ratios=[1.6, 1, 1][: 2 + has_map])
    top, middle, bottom = (*panels, None)[:3]
    for number, scan in enumerate(scans):
        look = level_look(number)
        rows = (
            (top, scan.value),
            (middle, np.rad2deg(np.arccos(np.clip(scan.facing, -1, 1)))),
            (bottom, scan.share),
        )
        for axes, curve in rows[: len(panels)]:
            axes.plot(scan.time, curve, **look, alpha=_FAINT)
            axes.plot(scan.time, np.where(scan.feasible, curve, np.nan), **look)
    closed = ~np.any([scan.feasible for scan in scans], axis=0)
    time = scans[0].time
    for axes in panels:
        axes.fill_between(
            time, 0, 1, where=closed, transform=axes.get_xaxis_transform(), color=SHADE, linewidth=0
        )
        axes.margins(x=0)
    for candidate in found.candidates:
        top.plot(
            candidate.time,
            candidate.value,
            **(_CHOSEN if candidate == found.candidate else _MINIMUM),
            clip_on=False,
        )
    if found.candidate is not None:
        for axes in panels:
            axes.axvline(found.candidate.time, color=COLOURS[0], linewidth=0.6, linestyle=(0, (4, 2)))
    if grasped is not None:
        for axes in panels:
            axes.axvline(grasped, **_GRASPED)
    top.set_ylabel("criterion [m]")
    middle.set_ylabel("approach [deg]")
    middle.axhline(90, color="0.45", linewidth=0.6)
    if has_map:
        bottom.set_ylabel("map share [-]")
        bottom.set_ylim(0, 1.02)
    panels[-1].set_xlabel("time [s]")
    figure.align_ylabels()
    handles = [Line2D([], [], **level_look(number)) for number in range(len(scans))]
    labels = [scan.grasp for scan in scans]
    if found.candidate is not None:
        handles.append(Line2D([], [], **_CHOSEN))
        labels.append(f"chosen, {found.candidate.time:.4g} s")
    if grasped is not None:
        handles.append(Line2D([], [], **_GRASPED))
        labels.append(f"grasp, {grasped:.4g} s")
    if len(found.candidates) > 1:
        handles.append(Line2D([], [], **_MINIMUM))
        labels.append("local minimum")
    if closed.any():
        handles.append(Patch(facecolor=SHADE))
        labels.append("no grasp possible")
    legend_above(figure, handles, labels)
    return figure
