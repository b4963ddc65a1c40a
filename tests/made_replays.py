"""Small replays made by hand: a box that slides along x while another turns about z."""

from __future__ import annotations

import numpy as np

from jffsr.viz.replay.replay import Arrow, Axes, Panel, Replay, Solid, Way

CUBE = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
# Two triangles a side, counter-clockwise seen from outside.
SIDES = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]
)  # fmt: skip


def boxes_replay(title: str = "boxes", frames: int = 21, duration: float = 2.0, start: float = 0.0) -> Replay:
    """Two boxes over `duration`, s: the first goes from x = 0 to 3 m, to a limit, the second turns by 90 deg."""
    share = np.linspace(0.0, 1.0, frames)
    time = start + duration * share
    way = np.stack([3.0 * share, 0.0 * share, 0.0 * share], axis=1)
    still = np.tile([0.0, 2.0, 0.0], (frames, 1))
    upright = np.tile([1.0, 0.0, 0.0, 0.0], (frames, 1))
    half = 0.25 * np.pi * share
    turning = np.stack([np.cos(half), 0 * half, 0 * half, np.sin(half)], axis=1)
    return Replay(
        title=title,
        time=time,
        solids=(
            Solid("slider", CUBE, SIDES, (0.2, 0.4, 0.8), way, upright, nearness=share),
            Solid("turner", CUBE, SIDES, (0.8, 0.8, 0.8), still, turning),
        ),
        ways=(
            Way("way", way, (0.9, 0.3, 0.1)),
            Way("plan", np.add(way, [0.0, 0.0, 1.0]), (0.2, 0.6, 0.3), ahead=True),
        ),
        arrows=(Arrow("push", way, np.tile([0.0, 0.0, 1.0], (frames, 1)), (0.9, 0.3, 0.1)),),
        axes=(Axes("frame", still, turning, 0.5),),
        panels=(
            Panel("place", "m", time, {"x": way[:, 0], "y": way[:, 1]}, bounds=(3.0,)),
            Panel("left", "m", time, {"left": 3.001 - way[:, 0]}, logarithmic=True),
        ),
        marks=(("half", start + 0.5 * duration),),
        legend=("Two boxes.",),
    )
