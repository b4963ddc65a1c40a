"""Five ways to learn an unknown load, each holding the base still after a capture while it learns.

Run it from the root of the repository: `python -m experiments.reactionless.estimators`. It writes the tables and the
figure of docs/benchmarks/reactionless_estimators.md and the numbers of every run beside them.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from experiments.pages import fill
from experiments.reactionless.cases import PLANAR, SPATIAL, Scene, captures
from jffsr.compiling import jit
from jffsr.reactionless.estimation.adaptive import AdaptiveReactionless
from jffsr.reactionless.estimation.commanded import LoadHistory, SensorNoise, commanded_run
from jffsr.reactionless.estimation.excitation import SineSum
from jffsr.reactionless.estimation.forgetting import ClockForgetting, InnovationForgetting
from jffsr.reactionless.estimation.least_squares import RecursiveLeastSquares, SlidingWindow
from jffsr.reactionless.estimation.models import LoadModel, RegressedLoad
from jffsr.reactionless.estimation.parameters import LoadParameters
from jffsr.spatial.rotation import quaternion_to_rotation_vector
from jffsr.viz.save import save_figure
from jffsr.viz.style import legend_above, line_look

PERIOD, COUNT, CHANGE, LAST = 0.01, 6000, 3000, 500
NOISE = SensorNoise(base_rate=1e-5, joint_position=1e-5, joint_rate=1e-4)
NONE = SensorNoise(0.0, 0.0, 0.0)
AMPLITUDE = 0.1
# Samples of base rates that are kept for the figure.
EVERY = 20


def estimators(variance: float) -> dict[str, LoadModel]:
    """By name, all with Q(0) = 1.4 E; the variance, (N m s)^2, is that of the least squares."""
    return {
        "plain": RegressedLoad(RecursiveLeastSquares(variance=variance)),
        "sliding window of 1 s": RegressedLoad(SlidingWindow(100, variance=variance)),
        "clock forgetting": RegressedLoad(RecursiveLeastSquares(ClockForgetting(), variance=variance)),
        "innovation forgetting": RegressedLoad(
            RecursiveLeastSquares(InnovationForgetting(variance=1e-5, memory=100.0), variance=variance)
        ),
        "the load's parameters": LoadParameters(
            base_rate_noise=NOISE.base_rate, joint_rate_noise=NOISE.joint_rate
        ),
    }


@dataclass(frozen=True)
class Study:
    """A scene with the variance of its least squares, and which estimators."""

    name: str
    scene: Scene
    variance: float
    names: tuple[str, ...]


ALL = tuple(estimators(1.0))
STUDIES = (
    Study("planar", PLANAR, 1e-2, ALL),
    Study("published", PLANAR, 1.0, ALL[:-1]),
    Study("spatial", SPATIAL, 1e-2, ALL),
)


def measure(scene: Scene, model: LoadModel, cases: dict, noise: SensorNoise, seeds: list[int]) -> dict:
    """Numbers of every seed, and the base's rates, rad/s, on a coarser grid."""
    reference = AdaptiveReactionless(
        scene.robot, model, PERIOD, SineSum.spread(scene.robot.num_joints, AMPLITUDE), axes=scene.axes
    )

    @jit
    def run(cases, noise, keys):
        def one(case, key):
            history = LoadHistory(case["first"], case["second"], CHANGE * PERIOD, case["momentum"])
            joints = jnp.asarray(scene.joints)
            found = commanded_run(
                scene.robot, history, reference, joints, case["rates"], PERIOD, COUNT, noise, key
            )
            rate = jnp.linalg.norm(found.base_rate, axis=-1)
            turned = jnp.linalg.norm(jax.vmap(quaternion_to_rotation_vector)(found.base_quaternion), axis=-1)
            covariance = found.states.model.covariance
            return {
                "drift": jnp.rad2deg(jnp.max(turned)),
                "before": jnp.sqrt(jnp.mean(rate[CHANGE - LAST : CHANGE] ** 2)),
                "end": jnp.sqrt(jnp.mean(rate[-LAST:] ** 2)),
                "trace": jnp.max(jnp.trace(covariance, axis1=1, axis2=2)),
                "rates": jnp.max(jnp.abs(found.joint_velocity)),
                "course": rate[::EVERY],
            }

        return jax.lax.map(lambda pair: one(*pair), (cases, keys))

    keys = jax.vmap(jax.random.PRNGKey)(jnp.asarray(seeds))
    return {name: np.asarray(value) for name, value in run(cases, noise, keys).items()}


def lines(count: int, studies: tuple[Study, ...] = STUDIES, first: int = 0) -> tuple[list[dict], dict]:
    """One line for each study, estimator and noise, with a value for each seed; and the median courses."""
    found, courses = [], {}
    seeds = list(range(first, first + count))
    for study in studies:
        cases = captures(study.scene, seeds)
        for name in study.names:
            model = estimators(study.variance)[name]
            for label, noise in (("none", NONE), ("sensors", NOISE)):
                numbers = measure(study.scene, model, cases, noise, seeds)
                course = numbers.pop("course")
                courses[study.name, name, label] = np.median(course, axis=0)
                line = {"study": study.name, "estimator": name, "noise": label, "first_seed": first}
                found.append(line | {key: [float(f"{v:.3g}") for v in x] for key, x in numbers.items()})
                summary = {key: float(np.median(value)) for key, value in numbers.items()}
                print(study.name, name, label, {k: f"{v:.3g}" for k, v in summary.items()}, flush=True)
    return found, courses


def tables(found: list[dict]) -> str:
    """A table for each study: medians over the seeds, and the worst of them."""
    text = []
    for study in STUDIES:
        own = [line for line in found if line["study"] == study.name]
        if not own:
            continue
        seeds = len(own[0]["drift"])
        arm = study.scene.robot.name
        text.append(
            f"`{arm}`, r = {study.variance:g} (N m s)^2 in the least squares, {seeds} seeds: median (worst).\n\n"
            "| estimator | noise | base drift, deg | settled before the change, rad/s | settled at the end, rad/s | "
            "largest trace of Q |\n|---|---|---|---|---|---|"
        )
        for name in study.names:
            for noise in ("none", "sensors"):
                line = next(one for one in own if one["estimator"] == name and one["noise"] == noise)
                cells = [
                    f"{np.median(line[key]):.2g} ({np.max(line[key]):.2g})"
                    for key in ("drift", "before", "end")
                ]
                text.append(f"| {name} | {noise} | {' | '.join(cells)} | {max(line['trace']):.3g} |")
        text.append("")
    return "\n".join(text).strip()


def draw(path: Path, courses: dict, study: str) -> None:
    """The base's rate over time in the median, without noise and with."""
    figure = Figure(figsize=(8.0, 3.6), layout="constrained")
    axes, drawn = figure.subplots(1, 2, sharey=True), []
    time = PERIOD * (1 + EVERY * np.arange(COUNT // EVERY))
    for axis, noise in zip(axes, ("none", "sensors"), strict=True):
        for index, name in enumerate(ALL):
            drawn += axis.plot(time, courses[study, name, noise], **line_look(index))
        axis.set(xlabel="time [s]", yscale="log", title="without noise" if noise == "none" else "with noise")
        axis.yaxis.set_major_locator(LogLocator())
        axis.yaxis.set_minor_formatter(NullFormatter())
        axis.axvline(CHANGE * PERIOD, color="0.6", linewidth=0.8, linestyle=":")
    axes[0].set_ylabel("base rate [rad/s]")
    legend_above(figure, drawn[: len(ALL)], list(ALL))
    save_figure(figure, path.with_suffix(""), ("png",))


def main() -> None:
    """Carry the runs out, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=20, help="seeds")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--studies", default=",".join(study.name for study in STUDIES))
    parser.add_argument("--out", default="docs/benchmarks/reactionless_estimators.md")
    arguments = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    studies = tuple(study for study in STUDIES if study.name in arguments.studies.split(","))
    found, courses = lines(arguments.count, studies, arguments.first)
    page = Path(arguments.out)
    with page.with_suffix(".jsonl").open("w", encoding="utf-8") as file:
        file.writelines(json.dumps(line) + "\n" for line in found)
    fill(page, tables(found), "Learning an unknown load while the base is held")
    if studies and studies[0].name == "planar":
        draw(page.with_suffix(".png"), courses, "planar")


if __name__ == "__main__":
    main()
