"""What is written into a film: titles, what lines and colours are, the clock, the speed, and a bar of the time."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from jffsr.viz.replay.film.sky import paled
from jffsr.viz.replay.film.tiles import Tile, strip_height
from jffsr.viz.replay.film.timing import Timing, speed_text
from jffsr.viz.replay.replay import Colour, Replay
from jffsr.viz.replay.shading import AT, FAR, STATES, warned

_INK, _QUIET, _STRIP, _RAIL, _BAR = (
    (236, 240, 247),
    (150, 161, 181),
    (8, 11, 20),
    (38, 47, 66),
    (104, 163, 240),
)


class Words:
    """Everything written into the pictures of one film; what never changes is drawn once."""

    def __init__(
        self, replays: Sequence[Replay], tiles: Sequence[Tile], width: int, height: int, timing: Timing
    ):
        self._size, self._timing = (width, height), timing
        self._unit = height / 720
        strip = strip_height(height)
        self._top = height - strip
        self._large, self._small = _font(round(21 * self._unit)), _font(round(15 * self._unit))
        margin = round(24 * self._unit)
        self._rail = (margin, width - margin, self._top + round(0.28 * strip), max(round(4 * self._unit), 2))
        self._line = self._top + round(0.66 * strip)
        self._still = Image.new("RGBA", self._size, (0, 0, 0, 0))
        draw = ImageDraw.Draw(self._still)
        known: set[tuple[str, Colour]] = set()
        for replay, tile in zip(replays, tiles, strict=True):
            self._write_tile(draw, replay, tile, len(replays) > 1, known)
        self._bottom = self._still_strip(replays, strip)
        box = self._still.getbbox()
        self._box = box
        self._still = self._still.crop(box) if box else None

    def onto(self, picture: np.ndarray, instant: float) -> np.ndarray:
        """The picture (h, w, 3) with everything written into it that belongs to an instant, s."""
        image = Image.fromarray(picture)
        if self._still is not None:
            image.paste(self._still, self._box[:2], self._still)
        image.paste(self._bottom, (0, self._top))
        draw = ImageDraw.Draw(image)
        left, right, top, thick = self._rail
        span = self._timing.end - self._timing.start
        share = (instant - self._timing.start) / span if span > 0 else 0.0
        reached = left + share * (right - left)
        draw.rectangle((left, top, reached, top + thick - 1), fill=_BAR)
        knob = 1.6 * thick
        middle = top + 0.5 * (thick - 1)
        draw.ellipse((reached - knob, middle - knob, reached + knob, middle + knob), fill=_INK)
        draw.text((left, self._line), f"{instant:.{self._decimals()}f} s", _INK, self._large, "lm")
        return np.asarray(image)

    def _decimals(self) -> int:
        """Digits after the point so that the clock is seen to run."""
        span = max(self._timing.end - self._timing.start, 1e-12)
        return int(np.clip(np.ceil(2 - np.log10(span)), 1, 6))

    def _still_strip(self, replays: Sequence[Replay], strip: int) -> Image.Image:
        image = Image.new("RGB", (self._size[0], strip), _STRIP)
        draw = ImageDraw.Draw(image)
        left, right, top, thick = self._rail
        top, line = top - self._top, self._line - self._top
        draw.rectangle((left, top, right, top + thick - 1), fill=_RAIL)
        speed = _speed(self._timing.speed)
        draw.text((right, line), speed, _QUIET, self._small, "rm")
        taken = right - max(120 * self._unit, draw.textlength(speed, self._small) + 40 * self._unit)
        span = self._timing.end - self._timing.start
        free = left + draw.textlength("0000.000 s", self._large)
        gaps = [(free, taken)]
        for name, instant in sorted(
            {mark for replay in replays for mark in replay.marks}, key=lambda m: m[1]
        ):
            if span <= 0 or not self._timing.start <= instant <= self._timing.end:
                continue
            place = left + (instant - self._timing.start) / span * (right - left)
            draw.line((place, top - thick, place, top + 2 * thick), fill=_QUIET, width=max(thick // 3, 1))
            half = 0.5 * draw.textlength(name, self._small)
            centre = min(max(place, free + half), right - half)
            # Where names would cover each other, the later one is left out.
            if abs(centre - place) <= half and centre + half < taken:
                draw.text((centre, line), name, _QUIET, self._small, "mm")
                free = centre + half + 12 * self._unit
                gaps[-1:] = [(gaps[-1][0], centre - half), (free, taken)]
        self._write_colours(draw, line, gaps, colours_shown(replays))
        return image

    def _write_colours(
        self,
        draw: ImageDraw.ImageDraw,
        line: float,
        gaps: Sequence[tuple[float, float]],
        colours: Sequence[tuple[Colour, str]],
    ) -> None:
        """What the colours of bodies mean, at the end of the last gap that has room for it."""
        side = 12 * self._unit
        widths = [3.6 * side + draw.textlength(meaning, self._small) for _, meaning in colours]
        ends = [end for start, end in gaps if end - start >= sum(widths)]
        if not colours or not ends:
            return
        left = ends[-1] - sum(widths)
        for (colour, meaning), width in zip(colours, widths, strict=True):
            draw.rectangle((left, line - 0.5 * side, left + side, line + 0.5 * side), fill=_ink(colour))
            draw.text((left + 1.6 * side, line), meaning, _QUIET, self._small, "lm")
            left += width

    def _write_tile(
        self, draw: ImageDraw.ImageDraw, replay: Replay, tile: Tile, framed: bool, known: set
    ) -> None:
        margin = round(24 * self._unit)
        room = tile.width - 2 * margin
        title = _fitting(replay.title, self._large, room)
        draw.text((tile.left + margin, tile.top + margin), title, (*_INK, 255), self._large, "lm")
        if framed:
            draw.rectangle(
                (tile.left, tile.top, tile.left + tile.width - 1, tile.top + tile.height - 1),
                outline=(*_RAIL, 255),
            )
        self._write_keys(draw, tile, margin, known, _keys(replay))

    def _write_keys(
        self, draw, tile: Tile, margin: int, known: set, keys: Sequence[tuple[str, Colour, bool]]
    ) -> None:
        """What the lines are, in one row along the bottom; of several tiles, where a line first appears."""
        dash, line = 20 * self._unit, tile.top + tile.height - margin
        left, right = tile.left + margin, tile.left + tile.width - margin
        for name, colour, pointed in keys:
            end = left + 1.4 * dash + self._small.getlength(name)
            if (name, colour) in known or end > right:
                continue
            known.add((name, colour))
            if pointed:
                tip = 5 * self._unit
                corners = (
                    (left + dash, line),
                    (left + dash - 2 * tip, line - tip),
                    (left + dash - 2 * tip, line + tip),
                )
                draw.polygon(corners, fill=(*_ink(colour), 255))
            half = 1.5 * self._unit
            draw.rectangle((left, line - half, left + dash, line + half), fill=(*_ink(colour), 255))
            draw.text((left + 1.4 * dash, line), name, (*_QUIET, 255), self._small, "lm")
            left = end + 1.2 * dash


def colours_shown(replays: Sequence[Replay]) -> list[tuple[Colour, str]]:
    """Those of the colours of bodies near their limits that come up, and what they mean."""
    found = [s.nearness for replay in replays for s in replay.solids if s.nearness is not None]
    nearest = float(np.max(np.nan_to_num(np.concatenate(found), nan=np.inf))) if found else 0.0
    if nearest <= FAR:
        return []
    return [(colour, meaning) for colour, meaning in STATES if colour != AT or warned(colour, nearest) == AT]


def _keys(replay: Replay) -> list[tuple[str, Colour, bool]]:
    """Names and colours of all lines, and whether they are arrows."""
    ways = [(way.name, paled(way.colour) if way.ahead else way.colour, False) for way in replay.ways]
    return list(dict.fromkeys(ways + [(arrow.name, arrow.colour, True) for arrow in replay.arrows]))


def _ink(colour: Colour) -> tuple[int, int, int]:
    return tuple(round(255 * part) for part in colour)


def _speed(speed: float) -> str:
    return speed_text(speed) or "real time"


def _fitting(words: str, font: ImageFont.FreeTypeFont, room: float) -> str:
    """The words, shortened where they are wider than the room, pixels."""
    if font.getlength(words) <= room:
        return words
    while words and font.getlength(words + "…") > room:
        words = words[:-1]
    return words.rstrip() + "…"


@lru_cache
def _font(size: int) -> ImageFont.FreeTypeFont:
    path = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
    return ImageFont.truetype(str(path), size)
