"""A replay with its plots, whose cursor goes along, as a piece of a page."""

from __future__ import annotations

import json
from collections.abc import Sequence
from html import escape

import numpy as np

from jffsr.viz.replay.momenta import legend_of
from jffsr.viz.replay.recording import all_times, record_html
from jffsr.viz.replay.replay import Colour, Panel, Replay
from jffsr.viz.replay.shading import STATES
from jffsr.viz.report.plots import Plot, draw_panel, points_each
from jffsr.viz.style import line_look

_DIGITS = 4


def replay_block(replays: Sequence[Replay], title: str) -> str:
    """The replays played by viser's client in a frame of the page, beside the plots of each.

    Raises InputError where viser is not installed.
    """
    page = escape(record_html(replays, title), quote=True)
    groups, data = [], []
    points = points_each(sum(len(replay.panels) for replay in replays))
    for number, replay in enumerate(replays):
        plots = [
            draw_panel(panel, replay.marks, f"{number}-{place}", points)
            for place, panel in enumerate(replay.panels)
        ]
        figures = "\n".join(_figure(p, panel) for p, panel in zip(plots, replay.panels, strict=True))
        hidden = "" if number == 0 else " hidden"
        groups.append(f'<div class="plots" data-replay="{number}"{hidden}>\n{figures}\n</div>')
        data.append([_numbers(plot) for plot in plots])
    tabs = ""
    if len(replays) > 1:
        options = "".join(
            f'<option value="{number}">{escape(replay.title)}</option>'
            for number, replay in enumerate(replays)
        )
        tabs = f'<label class="choice">Plots of <select id="replay-choice">{options}</select></label>'
    legend = "".join(f"<li>{escape(line)}</li>" for line in legend_of(replays))
    numbers = json.dumps({"start": float(all_times(replays)[0]), "plots": data}, separators=(",", ":"))
    numbers = numbers.replace("</", "<\\/")
    return f"""<section class="replay" id="replay">
<div class="stage"><iframe id="replay-frame" title="Replay in three dimensions" srcdoc="{page}"></iframe></div>
<div class="beside">{tabs}
{"".join(groups)}
</div>
<ul class="legend">{_states(replays)}{legend}
<li>Drag to look around; space plays and pauses; click on a plot to go to that instant.</li></ul>
<script type="application/json" id="replay-data">{numbers}</script>
</section>"""


def _states(replays: Sequence[Replay]) -> str:
    """The colours of what comes near a limit; nothing where nothing has one."""
    near = (solid.nearness for replay in replays for solid in replay.solids)
    # Of a part without a limit it is zero throughout.
    if not any(values is not None and np.any(values) for values in near):
        return ""
    keys = "; ".join(f"{_swatch(colour)}{escape(meaning)}" for colour, meaning in STATES)
    return f"<li>Colours: a part's own up to 70 % of its limit; {keys}.</li>"


def _swatch(colour: Colour) -> str:
    return f'<i style="background:rgb({", ".join(str(round(255 * part)) for part in colour)})"></i>'


def _figure(plot: Plot, panel: Panel) -> str:
    keys = "".join(
        f'<li><i style="background:{line_look(number)["color"]}"></i>{escape(name)} <output></output></li>'
        for number, name in enumerate(panel.curves)
    )
    where = f'data-left="{plot.left:.5f}" data-right="{plot.right:.5f}"'
    when = f'data-first="{plot.first!r}" data-last="{plot.last!r}"'
    return (
        f'<figure class="plot"><figcaption>{escape(panel.title)} [{escape(panel.unit)}]</figcaption>\n'
        f'<div class="drawing" {where} {when}>{plot.svg}<b class="cursor"></b></div>\n'
        f'<ul class="keys">{keys}</ul></figure>'
    )


def _numbers(plot: Plot) -> dict:
    return {"time": _short(plot.time, 6), "values": [_short(curve, _DIGITS) for curve in plot.values]}


def _short(values: np.ndarray, digits: int) -> list[float | None]:
    return [float(f"{value:.{digits}g}") if np.isfinite(value) else None for value in values.tolist()]
