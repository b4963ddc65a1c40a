"""The background of a film: dark blue, a little lighter above, with a few dim stars."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from jffsr.viz.replay.replay import Colour

ABOVE, BELOW = np.array([30.0, 41.0, 64.0]), np.array([9.0, 13.0, 24.0])
_SIDE = 1024  # pixels of a face
_STARS = 260  # on each face
_PALE = 0.55
"""How much of the background is in the colour of a way that lies ahead."""


@lru_cache(maxsize=1)
def sky() -> np.ndarray:
    """The six faces of a cube around everything, one below the other, (6 s, s, 3), in the order that MuJoCo reads.

    The faces are right, left, up, down, front and back; the same at every call.
    """
    random = np.random.default_rng(7)
    level = np.linspace(1.0, -1.0, _SIDE)[:, None]
    across = np.linspace(-1.0, 1.0, _SIDE)[None, :]
    side = level / np.sqrt(1.0 + level**2 + across**2)
    pole = 1.0 / np.sqrt(1.0 + level**2 + across**2)
    heights = [side, side, pole, -pole, side, side]
    return np.concatenate([_face(height, random) for height in heights])


def _face(height: np.ndarray, random: np.random.Generator) -> np.ndarray:
    share = (0.5 + 0.5 * height)[..., None]
    colours = BELOW + (ABOVE - BELOW) * share**1.5
    place = random.integers(1, _SIDE - 1, (2, _STARS))
    light = 90.0 * random.random(_STARS) ** 4 + 12.0
    colours[place[0], place[1]] += light[:, None]
    # Half a step of noise hides the steps between the few dark colours there are.
    colours += random.uniform(-0.5, 0.5, (_SIDE, _SIDE, 1))
    return np.clip(np.round(colours), 0, 255).astype(np.uint8)


def paled(colour: Colour) -> Colour:
    """A colour as that of something which lies ahead, on the background of the film."""
    return tuple(np.asarray(colour) * (1 - _PALE) + _PALE * ABOVE / 255.0)
