"""Replays made by hand: boxes that slide, with nothing of a robot in them."""

from __future__ import annotations

from itertools import product

import numpy as np

from jffsr.viz.replay.replay import Arrow, Axes, Colour, Replay, Solid, Way

_FACES = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
_FACES += [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
STILL = np.array([1.0, 0.0, 0.0, 0.0])


def box(side: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of a cube about the origin, counter-clockwise seen from outside."""
    return side * np.array(list(product((-0.5, 0.5), repeat=3))), np.array(_FACES)


def sliding(name: str, colour: Colour, start, end, frames: int, nearness=None, side: float = 0.4) -> Solid:
    """A cube that slides along a straight line without turning."""
    position = np.linspace(start, end, frames)
    return Solid(name, *box(side), colour, position, np.tile(STILL, (frames, 1)), nearness)


def two_boxes(title: str = "two boxes", span: float = 2.0, nearness=None, frames: int = 5) -> Replay:
    """A grey cube at rest and a green one that passes it from -x to x, the way of which grows; a frame, an arrow."""
    green = sliding("green", (0.1, 0.8, 0.1), (-2.0, -0.8, 0.0), (2.0, -0.8, 0.0), frames, nearness)
    grey = sliding("grey", (0.6, 0.6, 0.6), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), frames, side=0.6)
    return Replay(
        title,
        np.linspace(0.0, span, frames),
        (green, grey),
        ways=(
            Way("way of green", green.position - [0.0, 0.5, 0.0], (1.0, 0.0, 1.0)),
            Way("planned", green.position - [0.0, 0.8, 0.0], (0.0, 0.9, 0.9), ahead=True),
        ),
        arrows=(Arrow("velocity", grey.position, np.tile([0.0, 0.9, 0.0], (frames, 1)), (0.9, 0.8, 0.1)),),
        axes=(Axes("frame", grey.position + np.array([0.0, 1.2, 0.0]), np.tile(STILL, (frames, 1)), 0.3),),
        marks=(("halfway", 0.5 * span),),
    )
