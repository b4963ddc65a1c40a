"""What a joint law's free numbers buy: the index reached by each law on the same tasks, against their number.

The sine-polynomial law has two numbers a joint; polynomials have degree - 5, clamped B-splines as many as they have
control points beyond the six that rest at both ends takes. Each is searched by the hybrid with one budget, gradients
charged, from several seeds.

Run it from the root of the repository: `python -m experiments.parametrisation`. Runs are kept one by one beside the
page; the same command goes on where it was stopped.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from pathlib import Path

import numpy as np

from experiments.comparison.profiles import SearchRun
from experiments.comparison.scenarios import Scenario
from experiments.comparison.searches import Search
from experiments.comparison.work import read_runs, run_missing
from experiments.pages import fill

HYBRID = Search("hybrid", "hybrid", gradients=True)
TASKS = {
    # The sine-polynomial law needs position limits, of which the paper's arm has none.
    "Hu torque": ("hu_2011", ("limits.position_deg=324",)),
    "wu6 tight": ("composite_wu6_tight", ("objective.joint_position.enabled=true",)),
}
EACH_JOINT = (1, 2, 3, 4, 6)
LAWS = ("sine-polynomial", "polynomial", "B-spline")


def scenarios() -> tuple[Scenario, ...]:
    """Every law on every task, named `task, law, numbers a joint`."""
    return tuple(
        Scenario(f"{task}, {law}, {count}", config, law, (*overrides, *_law(law, count)))
        for task, (config, overrides) in TASKS.items()
        for law in LAWS
        for count in (EACH_JOINT if law != LAWS[0] else (2,))
    )


def _law(law: str, count: int) -> tuple[str, ...]:
    """Overrides of a configuration, whatever law it has itself."""
    size = {
        LAWS[0]: ("kind=sine_polynomial", "degree=null", "control_points=null"),
        LAWS[1]: ("kind=polynomial", f"degree={count + 5}", "control_points=null"),
        LAWS[2]: ("kind=bspline", "degree=4", f"control_points={count + 6}"),
    }[law]
    return tuple(f"trajectory.{key}" for key in (*size, "box=3"))


def main() -> None:
    """Measure what is missing, then write the table into the page and draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--budget", type=int, default=5000, help="evaluations charged to each search")
    parser.add_argument("--out", default="docs/benchmarks/parametrisation.md")
    parser.add_argument("--redraw", action="store_true", help="from the runs kept beside --out alone")
    arguments = parser.parse_args()
    page = Path(arguments.out)
    kept = page.with_suffix(".jsonl")
    if not arguments.redraw:
        page.parent.mkdir(parents=True, exist_ok=True)
        run_missing(kept, scenarios(), [HYBRID], range(arguments.seeds), arguments.budget)
    runs, facts = read_runs(kept)
    reached = by_law(runs)
    fill(page, table(reached, facts), "What a joint law's free numbers buy")
    draw(page.with_suffix(".png"), reached)


def by_law(runs: list[SearchRun]) -> dict[tuple[str, str, int], np.ndarray]:
    """The final values of all seeds, by task, law and numbers a joint."""
    found = defaultdict(list)
    for run in runs:
        task, law, count = run.scenario.split(", ")
        found[task, law, int(count)].append(run.final)
    return {key: np.array(values) for key, values in found.items()}


def table(reached: dict[tuple[str, str, int], np.ndarray], facts: dict) -> str:
    """A row a law and size, for every task."""
    machine = facts["machine"]
    seeds = max(len(values) for values in reached.values())
    lines = [
        f"{seeds} seeds each, {facts['budget']:,} evaluations charged; {machine['processor']}, "
        f"{machine['cores']} cores, JAX {machine['versions']['jax']}.",
        "",
        "| task | law | free numbers | J best | J median | J worst |",
        "|---|---|---|---|---|---|",
    ]
    for (task, law, count), values in reached.items():
        free = facts["scenarios"][f"{task}, {law}, {count}"]["free"]
        cells = [f"{x:.4g}" for x in (values.min(), np.median(values), values.max())]
        lines.append(f"| {task} | {law} | {free} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def draw(path: Path, reached: dict[tuple[str, str, int], np.ndarray]) -> None:
    """Best of all seeds as a line, all seeds as points, one panel a task."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    styles = {LAWS[0]: ("#b03a5b", "D"), LAWS[1]: ("#00204d", "o"), LAWS[2]: ("#c79a00", "s")}
    figure, panels = plt.subplots(1, len(TASKS), figsize=(10, 4), layout="constrained")
    for axes, task in zip(panels, TASKS, strict=True):
        for law, (colour, marker) in styles.items():
            own = {count: values for (t, name, count), values in reached.items() if (t, name) == (task, law)}
            if not own:
                continue
            counts = sorted(own)
            axes.plot(
                counts, [own[c].min() for c in counts], color=colour, marker=marker, label=f"{law}, best"
            )
            for count in counts:
                axes.plot(
                    np.full(len(own[count]), count),
                    own[count],
                    marker,
                    markersize=4,
                    color=colour,
                    alpha=0.35,
                    linestyle="none",
                )
        axes.set(title=task, xlabel="free numbers a joint", ylabel="J reached", yscale="log")
        axes.set_xticks(EACH_JOINT)
        axes.grid(alpha=0.25, which="both")
    panels[0].legend(frameon=False)
    figure.savefig(path, dpi=130)
    plt.close(figure)


if __name__ == "__main__":
    main()
