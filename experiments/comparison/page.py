"""The page and the picture that the runs become."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from experiments.comparison.profiles import SearchRun, performance_profiles, standings
from experiments.comparison.searches import SEARCHES, Search

TAUS = (1e-1, 1e-3, 1e-6)
_FACTORS = np.logspace(0, 1.5, 201)
_COLOURS = {
    "QPSO": "#00204d",
    "PSO": "#3d7ab8",
    "GA": "#8a8a8a",
    "DE": "#2e8b57",
    "SSADE": "#9acd32",
    "CMA-ES": "#7b3294",
    "gradient": "#c2185b",
    "hybrid": "#e8590c",
    "memetic": "#d4a800",
}
_LINES = ("-", "--", ":")
_PLACES = {search.label: place for place, search in enumerate(SEARCHES)}


def tables(runs: list[SearchRun], facts: dict[str, Any]) -> str:
    """All that the page says of the runs."""
    return "\n\n".join([_facts(facts), _wins(runs), _solved(runs), _medians(runs)])


def _facts(facts: dict[str, Any]) -> str:
    machine = facts["machine"]
    lines = [
        f"Budget {facts['budget']:,} evaluations charged, {facts['members']} members, {facts['starts']} starts of "
        f"gradients; {machine['processor']}, {machine['cores']} cores, JAX {machine['versions']['jax']}.",
        "",
        "| scenario | what it is | free numbers | a gradient is charged |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| {name} | {line['about']} | {line['free']} | {line['gradient_charge']:.2f} |"
        for name, line in facts["scenarios"].items()
    ]
    return "\n".join(lines)


def _searches(runs: list[SearchRun]) -> list[str]:
    """Labels of the searches that ran, in the order of the list of all."""
    found = dict.fromkeys(run.search for run in runs)
    return sorted(found, key=lambda label: _PLACES.get(label, len(_PLACES)))


def _wins(runs: list[SearchRun]) -> str:
    """Searches by the number of problems (scenario and seed) on which none ends better."""
    table = standings(runs)
    total = {s: sum(row[s].wins for row in table.values() if s in row) for s in _searches(runs)}
    lines = [
        "### Wins",
        "",
        "| search | " + " | ".join([*table, "all"]) + " |",
        "|---" * (len(table) + 2) + "|",
    ]
    for search in sorted(total, key=total.get, reverse=True):
        cells = [f"{row[search].wins:.3g}" if search in row else "" for row in table.values()]
        lines.append(f"| {search} | " + " | ".join([*cells, f"{total[search]:.3g}"]) + " |")
    return "\n".join(lines)


def _solved(runs: list[SearchRun]) -> str:
    """The share of problems solved, and solved first, for some accuracies."""
    found = {tau: performance_profiles(runs, tau, np.array([1.0, np.inf])) for tau in TAUS}
    heads = [f"tau = {tau:g}: first | solved" for tau in TAUS]
    lines = ["### Solved", "", "| search | " + " | ".join(heads) + " |", "|---" * (1 + 2 * len(TAUS)) + "|"]
    order = sorted(_searches(runs), key=lambda s: -found[TAUS[1]][s][1])
    for search in order:
        cells = [f"{100 * share:.0f} %" for tau in TAUS for share in found[tau][search]]
        lines.append(f"| {search} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _medians(runs: list[SearchRun]) -> str:
    table = standings(runs)
    lines = ["### Final values: median (quartiles)", ""]
    lines += ["| search | " + " | ".join(table) + " |", "|---" * (len(table) + 1) + "|"]
    for search in _searches(runs):
        cells = []
        for row in table.values():
            standing = row.get(search)
            cells.append(
                "" if standing is None else f"{standing.median:.3g} ({standing.low:.2g}, {standing.high:.2g})"
            )
        lines.append(f"| {search} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def draw(path: Path, runs: list[SearchRun], searches: Sequence[Search]) -> None:
    """Performance profiles for three accuracies side by side."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    shown = [search for search in searches if search.label in _searches(runs)]
    # A colour for each family, a line for each of its members.
    styles, members = {}, dict.fromkeys(_COLOURS, 0)
    for search in shown:
        family = next(family for family in _COLOURS if search.label.startswith(family))
        styles[search.label] = {"color": _COLOURS[family], "linestyle": _LINES[members[family]]}
        members[family] += 1
    figure, all_axes = plt.subplots(1, len(TAUS), figsize=(12, 4.2), sharey=True, layout="constrained")
    for axes, tau in zip(all_axes, TAUS, strict=True):
        profiles = performance_profiles(runs, tau, _FACTORS)
        for label, style in styles.items():
            axes.step(_FACTORS, profiles[label], where="post", label=label, **style)
        axes.set(xscale="log", xlim=(1, _FACTORS[-1]), ylim=(0, 1.02), title=f"to tau = {tau:g}")
        axes.set_xlabel("times the evaluations of the first to solve it")
        axes.grid(alpha=0.25)
    all_axes[0].set_ylabel("share of problems solved")
    figure.legend(
        *all_axes[0].get_legend_handles_labels(), loc="outside right center", fontsize=8, frameon=False
    )
    figure.savefig(path, dpi=130)
    plt.close(figure)
