"""The picture: time a rollout of every opponent at the reference point, and how it grows with the work."""

from __future__ import annotations

from pathlib import Path

from experiments.benchmarks.cases import ROBOTS
from experiments.benchmarks.opponents import registry as r
from experiments.benchmarks.tables import number

# Told apart in grey as well: each line has its own mark and dashes.
STYLES = {
    r.FAST: ("#00204d", "-", "o"),
    r.KERNEL: ("#7a7a7a", ":", "v"),
    r.SHARED: ("#c79a00", "--", "s"),
    r.PINOCCHIO: ("#c79a00", "-", "D"),
    r.OBVIOUS: ("#b03a5b", "-", "^"),
    r.PLAIN: ("#b03a5b", "--", "x"),
}


def draw(rows: list[dict], path: Path) -> None:
    """Two panels of lines over one of bars, as a PNG."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    measured = [
        x for x in rows if x.get("work") == r.ROLLOUT and "median" in x and x["precision"] == "float64"
    ]
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.4), constrained_layout=True, width_ratios=(1.25, 1, 1))
    _bars(axes[0], measured)
    _lines(axes[1], measured, "batch", "200 steps, by batch")
    _lines(axes[2], measured, "steps", "batch 1,024, by steps")
    figure.suptitle("Rollouts of a seven-joint arm, float64", fontsize=11)
    lines, names = axes[1].get_legend_handles_labels()
    if lines:
        axes[2].legend(lines, names, frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    figure.savefig(path, dpi=130)
    plt.close(figure)


def _bars(axes, measured: list[dict]) -> None:
    """Reference point, one core and, where measured, all."""
    at = [x for x in measured if not x["axis"]]
    one = {x["opponent"]: 1e6 * x["median"] / x["done"] for x in at if x["threads"] == 1}
    many = {x["opponent"]: 1e6 * x["median"] / x["done"] for x in at if x["threads"] > 1}
    names = sorted(one, key=one.get, reverse=True)
    for place, name in enumerate(names):
        colour = STYLES.get(name, ("#9a9a9a",))[0]
        axes.barh(place, one[name], height=0.62, color=colour, alpha=0.85)
        axes.text(one[name] * 1.12, place, number(one[name]), va="center", fontsize=8)
        if name in many:
            axes.plot(many[name], place, marker="|", markersize=14, markeredgewidth=2.5, color="white")
            axes.plot(many[name], place, marker="|", markersize=14, markeredgewidth=1.2, color="black")
    axes.set_yticks(range(len(names)), names, fontsize=9)
    axes.set(xscale="log", xlim=(min([*one.values(), *many.values()]) / 2, max(one.values()) * 8))
    axes.set_xlabel("microseconds a rollout, one core" + (" (mark: all cores)" if many else ""))
    axes.set_title("200 steps, batch 1,024", fontsize=10)
    axes.spines[["top", "right"]].set_visible(False)


def _lines(axes, measured: list[dict], axis: str, title: str) -> None:
    rows = [x for x in measured if x["threads"] == 1 and x["axis"] in ("", axis)]
    rows = [x for x in rows if x["robot"] == ROBOTS["seven joints"]]
    for name, (colour, dashes, mark) in STYLES.items():
        points = sorted((x[axis], 1e6 * x["median"] / x["done"]) for x in rows if x["opponent"] == name)
        if len(points) > 1:
            axes.plot(
                *zip(*points, strict=True),
                color=colour,
                linestyle=dashes,
                marker=mark,
                markersize=5,
                label=name,
            )
    axes.set_visible(bool(axes.lines))
    axes.set(xscale="log", yscale="log")
    values = sorted({x[axis] for x in rows})
    axes.set_xticks(values, [f"{value:,}" for value in values])
    axes.minorticks_off()
    axes.set_xlabel("rollouts at once" if axis == "batch" else "steps")
    axes.set_title(title, fontsize=10)
    axes.set_ylabel("microseconds a rollout, one core")
    axes.grid(True, which="major", color="#e4e4e4", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
