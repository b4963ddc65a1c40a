"""The cost over two swept keys as a map of coloured cells."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from jffsr.planning.result import ResultCode
from jffsr.study.sweep.merging import MISSING
from jffsr.study.sweep.significance import ranked_cost
from jffsr.study.sweep.table import keys_of
from jffsr.viz.style import legend_above, new_figure, styled
from jffsr.viz.sweep_boxes import OPTIMIZER, lowest

if TYPE_CHECKING:
    from xarray import Dataset

MOST_LEVELS = 25
_MOST_PANELS = 6
_LOST = ListedColormap(["0.85"])
_WRITTEN = 10  # levels, up to which every cell has its number


@styled
def draw_map(dataset: Dataset) -> Figure | None:
    """Median J over the first two swept keys of at least two values, a panel for each optimizer.

    Each cell, where there is room, says the share of runs that met the accuracy. Medians are over everything else that
    was swept; the colours end four decades under the accuracy, and a cell is grey where half of its runs or more have
    no J. None where there are no two such keys.
    """
    keys = [
        key for key in keys_of(dataset) if key != OPTIMIZER and 2 <= len(_levels(dataset, key)) <= MOST_LEVELS
    ]
    if len(keys) < 2:
        return None
    across, up = keys[0], keys[1]
    panels = _levels(dataset, OPTIMIZER)[:_MOST_PANELS] if OPTIMIZER in keys_of(dataset) else [None]
    columns, rows = _levels(dataset, across), _levels(dataset, up)
    medians, met = zip(*(_cells(dataset, across, up, columns, rows, panel) for panel in panels), strict=True)
    known = np.concatenate([cells[np.isfinite(cells) & (cells > 0)] for cells in medians])
    if not known.size:
        return None
    floor = max(known.min(), lowest(dataset))
    norm = LogNorm(floor, max(known.max(), 10 * floor), clip=True)
    wide = max(1.2, min(0.34 * len(columns), 2.6))
    figure = new_figure(max(1.9, min(0.24 * len(rows) + 1.0, 4.0)), wide * len(panels) + 1.5)
    all_axes = figure.subplots(1, len(panels), squeeze=False, sharey=True)[0]
    for axes, panel, cells, share in zip(all_axes, panels, medians, met, strict=True):
        image = axes.imshow(
            np.where(np.isinf(cells), np.nan, cells),
            origin="lower",
            aspect="auto",
            cmap="viridis_r",
            norm=norm,
        )
        axes.imshow(np.where(np.isinf(cells), 0.0, np.nan), origin="lower", aspect="auto", cmap=_LOST)
        axes.spines[:].set_visible(False)
        axes.set_xticks(range(len(columns)), [_text(value) for value in columns])
        axes.set_yticks(range(len(rows)), [_text(value) for value in rows])
        if len(columns) > 5 or any(len(_text(value)) > 5 for value in columns):
            axes.tick_params(axis="x", rotation=60)
        axes.set_xlabel(across)
        if panel is not None:
            axes.set_title(str(panel))
        if len(columns) <= _WRITTEN:
            _write_shares(axes, cells, share, norm)
    all_axes[0].set_ylabel(up)
    if any(np.any(np.isinf(cells)) for cells in medians):
        legend_above(figure, [Patch(facecolor="0.85")], ["no J in half of the runs or more"])
    figure.colorbar(
        image, ax=all_axes, label="median J [-]", extend="min" if known.min() < floor else "neither"
    )
    return figure


def _levels(dataset: Dataset, key: str) -> list:
    values = dataset[key].values
    if values.dtype.kind in "if":
        return np.unique(values).tolist()
    return list(dict.fromkeys(values.tolist()))


def _cells(dataset, across, up, columns, rows, panel) -> tuple[np.ndarray, np.ndarray]:
    """Medians and shares met, (rows, columns), NaN where there is no run."""
    here = dataset["code"].values != MISSING
    if panel is not None:
        here &= dataset[OPTIMIZER].values == panel
    cost = ranked_cost(dataset)
    medians = np.full((len(rows), len(columns)), np.nan)
    met = medians.copy()
    for i, row in enumerate(rows):
        for j, column in enumerate(columns):
            runs = here & (dataset[up].values == row) & (dataset[across].values == column)
            if runs.any():
                medians[i, j] = np.median(cost[runs])
                met[i, j] = np.mean(dataset["code"].values[runs] == ResultCode.ACCURACY_MET)
    return medians, met


def _write_shares(axes, cells: np.ndarray, share: np.ndarray, norm: LogNorm) -> None:
    for (i, j), part in np.ndenumerate(share):
        if np.isfinite(part):
            dark = np.isfinite(cells[i, j]) and norm(cells[i, j]) > 0.5
            axes.text(
                j,
                i,
                f"{100 * part:.0f}%",
                ha="center",
                va="center",
                fontsize=6,
                color="white" if dark else "black",
            )


def _text(value) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
