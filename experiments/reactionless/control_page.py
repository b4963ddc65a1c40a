"""The controllers' comparison as tables and figures."""

from __future__ import annotations

from pathlib import Path
from statistics import median

import numpy as np

from experiments.reactionless.control_runs import (
    COMPUTED,
    CONTROLLERS,
    ELM,
    HIT,
    LEARNT,
    ONES,
    PASSIVITY,
    PD,
    PSO,
    QUIET,
    SIMULATION,
    SSADE,
    STROKE,
    STRUCK,
)
from jffsr.reactionless.plant_run import LoopCode
from jffsr.viz.style import legend_above, line_look, new_figure, styled

PRINTED = {
    SIMULATION: {SSADE: "-3.0e-7", ELM: "-4.5e-7", PSO: "-4.2e-7"},
    STROKE: {SSADE: "-5.3e-6", ELM: "-7.6e-6", PSO: "-6.9e-6"},
}
TITLES = {
    SIMULATION: "The simulation: the printed disturbance, 20 s",
    STROKE: "The pendulum's stroke: a moment of 3.78 N m for 10 ms at the tool, at 10 s",
    HIT: "The same with the yaw force of 37.8 N that goes with it",
    QUIET: "Without any disturbance",
}


def tables(facts: dict, rows: list[dict]) -> str:
    """Everything between the page's marks."""
    parts = [_about(facts)]
    for scene, title in TITLES.items():
        parts += [f"## {title}", _table(scene, [row for row in rows if row["scene"] == scene])]
    parts += ["## The machines themselves", _machines(facts["training"], facts["gain"])]
    parts += ["## SSADE-ELM against the others, seed by seed", _duels(rows)]
    parts += ["## MuJoCo as the plant", _mujoco(facts["mujoco"])]
    parts += ["## Sampling", _periods(facts["periods"])]
    return "\n\n".join(parts)


def _about(facts: dict) -> str:
    machine = facts["machine"]
    return (
        f"{facts['seeds']} seeds; {facts['evaluations']:,} evaluations of each search (the paper: 30,000). "
        f"{machine['processor']}, JAX {machine['versions']['jax']}. Medians over the seeds; errors are q - q_d of all "
        "three joints, in rad; `later` is the second half of the run, from 10 s on. Torque is the largest of any joint "
        "and seed."
    )


def _table(scene: str, rows: list[dict]) -> str:
    lines = [
        "| controller | mean | printed mean | rms | peak | mean later | rms later | peak later "
        "| base rate later [rad/s] | torque [N m] | results |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name in CONTROLLERS:
        group = [row for row in rows if row["controller"] == name]
        if not group:
            continue
        middle = {
            key: median(row[key] for row in group) for key in group[0] if key not in ("controller", "scene")
        }
        codes = sorted({row["code"] for row in group})
        results = ", ".join(
            f"{LoopCode(code).name} {sum(row['code'] == code for row in group)}" for code in codes
        )
        numbers = ("mean", "rms", "peak", "mean_later", "rms_later", "peak_later", "base_rate")
        cells = [f"{middle[key]:.3g}" for key in numbers]
        cells.insert(1, PRINTED.get(scene, {}).get(name, ""))
        cells += [f"{max(row['torque'] for row in group):.1f}", results]
        lines.append("| " + " | ".join([name, *cells]) + " |")
    return "\n".join(lines)


def _machines(training: dict[str, float], gain: dict[str, float]) -> str:
    lines = [
        "| machine | rms on the training runs [rad] | sum of h^2, its integral gain [1/s] |",
        "|---|---|---|",
    ]
    lines += [f"| {name} | {value:.4g} | {gain[name]:.1f} |" for name, value in training.items()]
    return "\n".join(lines)


def _duels(rows: list[dict]) -> str:
    lines = [
        "| scene | SSADE-ELM's rms lower than ELM's | than PSO-ELM's | than the integrator's | medians: SSADE-ELM, "
        "PSO-ELM, ELM, integrator | later: the same |",
        "|---|---|---|---|---|---|",
    ]
    for scene in (SIMULATION, STROKE):
        value = {
            (name, key): np.array([r[key] for r in rows if r["scene"] == scene and r["controller"] == name])
            for name in (SSADE, PSO, ELM, ONES)
            for key in ("rms", "rms_later")
        }
        cells = []
        for other in (ELM, PSO, ONES):
            won = value[SSADE, "rms"] < value[other, "rms"]
            cells.append(f"{won.sum()} of {won.size}")
        for key in ("rms", "rms_later"):
            cells.append(", ".join(f"{np.median(value[name, key]):.4g}" for name in (SSADE, PSO, ELM, ONES)))
        lines.append("| " + " | ".join([scene, *cells]) + " |")
    return "\n".join(lines)


def _mujoco(found: dict) -> str:
    return (
        f"SSADE-ELM, seed 0, the simulation: rms {found['rms']:.4g} rad here and {found['rms_mujoco']:.4g} rad in "
        f"MuJoCo; joint errors differ by at most {found['apart']:.2g} rad over the 20 s. MuJoCo "
        f"has four steps a period, the other plant one; MuJoCo's momentum moves by "
        f"{found['momentum']:.1e}; result {LoopCode(found['code']).name}."
    )


def _periods(rows: list[dict]) -> str:
    lines = [
        "The base's largest rate, rad/s, in 5 s that start on the reference, undisturbed, K = 5/s and Lambda = 1/s. "
        "Feedforward is computed torque with the true compound's model, so that only holding the torque over the "
        "period is left; PD knows the robot without load.",
        "",
        "| period [s] | at the start | feedforward | PD |",
        "|---|---|---|---|",
    ]
    for row in rows:
        lines.append(
            f"| {row['period']:g} | {row['started']:.1e} | {row['feedforward']:.3g} | {row['pd']:.3g} |"
        )
    steps = np.array([row["period"] for row in rows])
    rate = np.array([row["feedforward"] for row in rows])
    order = np.polyfit(np.log(steps), np.log(rate), 1)[0]
    lines += ["", f"With feedforward it falls as the period to the power {order:.2f}."]
    return "\n".join(lines)


@styled
def draw_errors(shown: dict, path: Path) -> None:
    """Joint errors over time, one panel a joint: the paper's Fig. 8."""
    names = (PD, ELM, PSO, SSADE, ONES, COMPUTED, PASSIVITY, LEARNT)
    figure = new_figure(5.2, 6.5)
    panels = figure.subplots(3, 1, sharex=True)
    handles = []
    for joint, axes in enumerate(panels):
        for index, name in enumerate(names):
            curve = shown[f"{SIMULATION}/{name}"]
            (line,) = axes.plot(curve["time"], 1e3 * np.array(curve["error"][joint]), **line_look(index))
            handles += [line] if joint == 0 else []
        axes.set_ylabel(f"joint {joint + 1}\nerror [mrad]")
        if joint > 0:
            axes.set_yscale("symlog", linthresh=10.0)
            axes.set_yticks([-10, 0, 10, 100], ["-10", "0", "10", "100"])
        axes.axhline(0.0, color="0.8", linewidth=0.5, zorder=0)
    figure.align_ylabels()
    panels[-1].set_xlabel("time [s]")
    panels[-1].set_xlim(0, curve["time"][-1])
    legend_above(figure, handles, list(names))
    figure.savefig(path, dpi=150)


@styled
def draw_momentum(shown: dict, path: Path) -> None:
    """Total angular momentum, the paper's Fig. 6, and the base's rate, with and without the stroke; SSADE-ELM."""
    figure = new_figure(3.6, 6.5)
    upper, lower = figure.subplots(2, 1, sharex=True)
    labels = {SIMULATION: "simulation", STROKE: "stroke at 10 s: moment", HIT: "stroke: moment and force"}
    handles = []
    for index, scene in enumerate(labels):
        curve = shown[f"{scene}/{SSADE}"]
        (line,) = upper.plot(curve["time"], curve["momentum"], **line_look(index))
        lower.plot(curve["time"], 1e3 * np.array(curve["base_rate"]), **line_look(index))
        handles.append(line)
    figure.align_ylabels()
    upper.set_ylabel("angular momentum\n[N m s]")
    lower.set_ylabel("base rate\n[mrad/s]")
    lower.set_xlabel("time [s]")
    lower.set_xlim(0, curve["time"][-1])
    lower.axvline(STRUCK, color="0.8", linewidth=0.5, zorder=0)
    legend_above(figure, handles, list(labels.values()))
    figure.savefig(path, dpi=150)
