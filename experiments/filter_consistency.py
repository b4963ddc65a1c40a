"""Whether the filter of a tumbling target knows its own errors: random targets drawn from the prior, seen and filtered.

At every time the mean over the runs of the normalised squared error of estimation (20 numbers) and of innovation (6)
is laid against the bounds that a chi-square mean keeps 95 times of 100. Seeds 0 to 199 judge; the filter was laid out
with others.

Run it from the root of the repository: `python -m experiments.filter_consistency`. Cases are kept one by one beside the
page; the same command goes on where it was stopped.
"""

from __future__ import annotations

import argparse
import json
from functools import partial
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.stats import chi2

from experiments.pages import fill
from jffsr.target.body import Target
from jffsr.target.camera import Camera, observe_target, sample_times
from jffsr.target.estimate import NUM_ERRORS, error_of, true_estimate
from jffsr.target.filter import (
    FilterSettings,
    chi_square_bounds,
    expected_innovation_squared,
    filter_target,
)
from jffsr.target.grasp_frames import fixed_frame
from jffsr.target.inertia_parameters import inertia_from_parameters
from jffsr.target.prediction import ConvergenceTolerances, convergence, prediction_error
from jffsr.target.prior import TargetPrior, draw_from_prior
from jffsr.target.tumbling import target_motion

COUNT, RUNS, HORIZON, EVERY, FIRST_SEED = 500, 200, 5.0, 10, 0


class Case(NamedTuple):
    """Noise, in standard ones, and the prior's deviations of inertia parameters and offset, m."""

    noise: float
    inertia: float
    offset: float


CASES = (Case(1.0, 0.05, 0.05), Case(3.0, 0.05, 0.05), Case(1.0, 0.1, 0.1), Case(3.0, 0.1, 0.1))

GRASP = (jnp.array([0.2, -0.1, 0.05]), jnp.array([0.5, 0.5, 0.5, 0.5]))


@partial(jax.jit, static_argnums=(0, 1, 3, 4, 5, 6, 8))
def simulate(camera, settings, prior, count, runs, horizon, every, first_seed, factor=1.0):
    """NEES, NIS, whether used, the last errors and deviations, and the predictions' errors and claims of many
    runs, with the seeds from the first one on; the tolerances of convergence are the standard ones times the factor."""
    usual = ConvergenceTolerances()
    tolerances = ConvergenceTolerances(*(factor * usual.sizes))

    def one(key):
        of_truth, of_camera = jax.random.split(key)
        drawn = draw_from_prior(prior, of_truth)
        target = Target(
            jnp.ones(()), inertia_from_parameters(drawn.inertia_parameters), drawn.marker_offset_T,
            jnp.array([1.0, 0, 0, 0]), jnp.zeros((0, 3)), jnp.zeros((0, 4)),
        )  # fmt: skip
        times = sample_times(camera, count)
        end = times[-1] + horizon
        motion = target_motion(target, drawn.state, end, 2 * int(count / camera.rate + horizon))
        states = jax.vmap(motion)(times)
        filtered = filter_target(observe_target(target, states, camera, of_camera), camera, prior, settings)
        estimate = filtered.estimate
        now = jax.vmap(motion)(times[settings.acquisition :])
        truth = jax.vmap(partial(true_estimate, target))(now)
        errors = jax.vmap(error_of)(estimate, truth)
        solved = jnp.linalg.solve(estimate.covariance, errors[..., None])[..., 0]
        nees = jnp.sum(errors * solved, axis=-1)
        some = jax.tree.map(lambda x: x[::every], estimate)
        declared, prediction = convergence(some, horizon, max(1, int(horizon)), GRASP, None, tolerances)

        def miss(predicted):
            frame = fixed_frame(motion(predicted.time), target.marker_position + GRASP[0], GRASP[1])
            return prediction_error(predicted, *frame)

        misses = jax.vmap(miss)(prediction)
        predicted_nees = jnp.sum(
            misses * jnp.linalg.solve(prediction.covariance, misses[..., None])[..., 0], axis=-1
        )
        return {
            "nees": nees,
            "nis": filtered.normalised_innovation_squared,
            "used": filtered.used,
            "lost": filtered.lost,
            "error": errors[::every],
            "deviation": some.standard_deviation,
            "declared": declared,
            "miss": misses,
            "predicted_nees": predicted_nees,
        }

    return jax.lax.map(one, jax.vmap(jax.random.key)(first_seed + jnp.arange(runs)), batch_size=min(runs, 25))


def summarise(found: dict[str, np.ndarray], settings: FilterSettings, factor: float, every: int) -> dict:
    """Means over the runs at each time, shares of times inside their 95 % bounds, and how convergence was declared."""
    runs = len(found["nees"])
    nees = found["nees"].mean(axis=0)
    low, high = chi_square_bounds(NUM_ERRORS, runs)
    used = found["used"].sum(axis=0)
    nis = (
        np.where(found["used"], found["nis"], 0).sum(axis=0)
        / used
        * 6
        / expected_innovation_squared(settings)
    )
    nis_low, nis_high = (chi2.ppf(tail, 6 * used) / used for tail in (0.025, 0.975))
    declared = found["declared"]
    first, ever = declared.argmax(axis=1), declared.any(axis=1)
    misses = np.linalg.norm(found["miss"][np.arange(runs), first].reshape(runs, 4, 3), axis=-1)
    right = np.all(misses <= factor * ConvergenceTolerances().sizes, axis=1)
    rate = Camera().rate
    return {
        "nees": nees,
        "nis": nis,
        "nees_inside": np.mean((nees > low) & (nees < high)),
        "nees_below": np.mean(nees <= low),
        "nees_above": np.mean(nees >= high),
        "nis_inside": np.mean((nis > nis_low) & (nis < nis_high)),
        "declared": ever.mean(),
        "right": right[ever].mean() if ever.any() else np.nan,
        "seconds": np.median(first[ever] * every + settings.acquisition) / rate if ever.any() else np.nan,
        "lost": int(found["lost"].any(axis=1).sum()),
    }


def measure(case: Case) -> dict:
    """The summary of one case."""
    prior = TargetPrior.create(inertia_deviation=case.inertia, offset_deviation=case.offset)
    settings, camera = FilterSettings(), Camera().scaled(case.noise)
    found = simulate(camera, settings, prior, COUNT, RUNS, HORIZON, EVERY, FIRST_SEED, case.noise)
    found = {name: np.asarray(value) for name, value in found.items()}
    return summarise(found, settings, case.noise, EVERY)


def written(case: Case, summary: dict) -> str:
    """One line of JSON for a case."""
    numbers = {key: np.round(value, 4).tolist() for key, value in summary.items()}
    return json.dumps({"case": list(case), **numbers})


def table(measured: dict[Case, dict]) -> str:
    """The page's table."""
    rows = [
        "| noise | prior: inertia, offset | innovation inside | estimation error inside, below, above |"
        " its mean at 10, 20, 30, 50 s | convergence declared, right, after | lost |",
        "|---|---|---|---|---|---|---|",
    ]
    for case, found in measured.items():
        at = [f"{found['nees'][k]:.1f}" for k in (0, 100, 200, -1)]
        inside = [f"{100 * found[f'nees_{k}']:.0f}" for k in ("inside", "below", "above")]
        rows.append(
            f"| {case.noise:g} x standard | {case.inertia:g}, {case.offset:g} m | {100 * found['nis_inside']:.0f} % "
            f"| {', '.join(inside)} % | {', '.join(at)} "
            f"| {100 * found['declared']:.0f} %, {100 * found['right']:.1f} %, {found['seconds']:.0f} s "
            f"| {found['lost']} |"
        )
    return "\n".join(rows)


def draw(measured: dict[Case, dict], path: Path) -> None:
    """Mean squares over time between their bounds."""
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    styles = (("#00204d", "-"), ("#c79a00", "-"), ("#00204d", ":"), ("#c79a00", ":"))
    begin, rate = FilterSettings().acquisition, Camera().rate
    for panel, key, freedom, name in zip(
        panels, ("nees", "nis"), (NUM_ERRORS, 6), ("estimation error", "innovation"), strict=True
    ):
        bounds = np.array(chi_square_bounds(freedom, RUNS)) / freedom
        panel.axhspan(*bounds, color="#dddddd", label="95 % bounds")
        for (case, found), (colour, line) in zip(measured.items(), styles, strict=False):
            time = (begin + np.arange(len(found[key]))) / rate
            label = f"{case.noise:g} x noise, prior {case.inertia:g}"
            panel.plot(time, np.array(found[key]) / freedom, line, color=colour, linewidth=1.2, label=label)
        panel.set_xlabel("time [s]")
        panel.set_ylabel(f"normalised squared {name} over {freedom}")
    panels[0].legend(fontsize=8)
    figure.savefig(path, dpi=130)
    plt.close(figure)


def main() -> None:
    """Measure the cases that are missing, then write the table and draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", default="docs/benchmarks/target_filter.md")
    page = Path(parser.parse_args().out)
    kept = page.with_suffix(".jsonl")
    lines = kept.read_text(encoding="utf-8").splitlines() if kept.exists() else []
    for case in CASES:
        if not any(Case(*json.loads(line)["case"]) == case for line in lines):
            lines.append(written(case, measure(case)))
            kept.write_text("\n".join(lines) + "\n", encoding="utf-8")
    measured = {Case(*found["case"]): found for found in map(json.loads, lines)}
    measured = {case: measured[case] for case in CASES}
    fill(page, table(measured), "Consistency of the target's filter")
    draw(measured, page.with_suffix(".png"))


if __name__ == "__main__":
    jax.config.update("jax_enable_x64", True)
    main()
