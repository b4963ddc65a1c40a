"""What it is worth to plan a capture anew while the target becomes better known.

Random captures (those of `experiments.captures`, from a seed of their own). A camera has watched the target for some
seconds when the robot starts, by a plan for the motion predicted then. Either it follows that plan, or the rest is
planned anew every 2.5 s with what the filter has learnt. Both are judged at the grasp, against the true target.

Run it from the root of the repository: `python -m experiments.replanning`. Cases are kept line by line in
runs/replanning, and the same command goes on where it was stopped.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import jax
import numpy as np
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from experiments.captures.sampling import (
    draw,
    first_feasible,
    geometry,
    initial_state,
    motion_of,
    read_seed,
    robot,
)
from experiments.captures.work import read_lines, write_line
from experiments.pages import fill
from jffsr.capture.candidates import CandidateSettings
from jffsr.capture.captures import Captures, CaptureSettings, CaptureTask, plan_captures
from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.outcome import CaptureCode
from jffsr.capture.replanning import Knowledge, replanned
from jffsr.clearance.model import ClearanceModel
from jffsr.compiling import jit
from jffsr.compiling.keeping import keep_programs
from jffsr.target.body import Target
from jffsr.target.camera import Camera, observe_target, sample_times
from jffsr.target.estimate import TargetEstimate, true_estimate
from jffsr.target.estimated import estimated_geometry, estimated_target
from jffsr.target.filter import FilterSettings, filter_target
from jffsr.target.prediction import ConvergenceTolerances
from jffsr.target.prior import TargetPrior, draw_from_prior
from jffsr.target.tumbling import state_before, target_motion
from jffsr.viz.save import save_figure
from jffsr.viz.style import WIDTH, legend_above, line_look, new_figure, styled

SEED = "replanning"
WATCHED = 15.0
"""s, that the camera has seen the target when the robot starts."""
WINDOW = (25.0, 45.0)
"""s, of possible times of the grasp."""
EVERY = 2.5
NOISES = (1.0, 3.0)
MOTION_STEPS = 96
SETTINGS = CaptureSettings(candidates=CandidateSettings(window=WINDOW), tolerance=1e-5)
WHAT = ("position, mm", "attitude, deg", "velocity, mm/s", "angular velocity, deg/s")
UNITS = np.array([1e3, np.rad2deg(1.0), 1e3, np.rad2deg(1.0)])


@dataclass(frozen=True)
class Case:
    """A true target in a sample's scene, and what a filter has estimated of it at every exposure."""

    number: int
    target: Target
    path: GraspPath
    geometry: object
    estimates: TargetEstimate


def watched(number: int, noise: float) -> Case:
    """The case of a sample: its marker at random, its inertia and offset as far from the prior as that says."""
    sample = draw(read_seed(SEED), number)
    rng = np.random.default_rng([read_seed(SEED), number, 1])
    bare = motion_of(sample)
    marker = rng.uniform(-1, 1, 3) * sample.half, _unit(rng.normal(size=4))
    true = Target.create(
        sample.inertia, 300.0, marker, {"handle": (sample.grasp_position, sample.grasp_quaternion)}
    )
    start = bare.initial_state
    past = jax.device_get(state_before(true, start, WATCHED))
    camera = Camera().scaled(noise)
    found = _estimated(true, past, _prior(true, start, number), jax.random.key(number), camera)
    path = GraspPath.create(replace(bare, target=true), "handle")
    return Case(number, true, path, geometry(sample.half), jax.device_get(found))


def _prior(true: Target, state, number: int) -> TargetPrior:
    """A prior whose mean is as far from the truth as its deviations say."""
    truth = true_estimate(true, state)
    wide = TargetPrior.create()
    around = replace(wide, inertia_parameters=truth.inertia_parameters, marker_offset_T=truth.marker_offset_T)
    drawn = draw_from_prior(around, jax.random.key(number))
    return replace(wide, inertia_parameters=drawn.inertia_parameters, marker_offset_T=drawn.marker_offset_T)


@partial(jax.jit, static_argnums=4)
def _estimated(true: Target, past, prior: TargetPrior, key, camera: Camera) -> TargetEstimate:
    """The filter's estimates after every exposure, from the past state on to the end of the window."""
    last = WATCHED + WINDOW[1]
    motion = target_motion(true, past, last, MOTION_STEPS)
    states = jax.vmap(motion)(sample_times(camera, int(last * camera.rate)))
    return filter_target(observe_target(true, states, camera, key), camera, prior).estimate


def known(case: Case, time: float, camera: Camera) -> Knowledge:
    """What is known `time` s after the robot starts, from the exposures that have been delivered by then."""
    exposure = int(np.floor((WATCHED + time - camera.delay) * camera.rate + 1e-9))
    estimate = jax.tree.map(lambda x: x[exposure - FilterSettings().acquisition], case.estimates)
    target = estimated_target(case.target, estimate)
    motion = jax.device_get(_moving(target, estimate.state))
    path = GraspPath.create(motion, "handle", begin=np.asarray(WATCHED - exposure / camera.rate))
    shapes = estimated_geometry(case.target, case.geometry, estimate)
    return Knowledge(time, path, ClearanceModel.create(robot(), shapes))


@jit
def _moving(target: Target, state):
    return target_motion(target, state, WATCHED + WINDOW[1], MOTION_STEPS)


def judged(number: int, noise: float) -> dict:
    """A case carried out: errors at the grasp of the first plan and of the last, m, rad, m/s and rad/s."""
    case, camera = watched(number, noise), Camera().scaled(noise)
    first = known(case, 0.0, camera)
    plan = plan_captures(robot(), [CaptureTask(first.path, first.clearance)], initial_state(), SETTINGS)
    line = {"number": number, "noise": noise, "code": int(plan.code[0]), "duration": float(plan.duration[0])}
    if plan.code[0] != CaptureCode.CAPTURED:
        return line
    return line | _followed(case, camera, plan)


def _followed(case: Case, camera: Camera, plan: Captures) -> dict:
    duration = float(plan.duration[0])
    times = np.arange(EVERY, duration, EVERY)
    problem, free = plan.problems[0], plan.free[0]
    once = replanned(problem, free, [], SETTINGS)
    news = [known(case, t, camera) for t in times]
    begin = time.perf_counter()
    found = replanned(problem, free, news, SETTINGS)
    seconds = time.perf_counter() - begin
    tried = len(found.legs) - 1 + len(found.refused)
    return {
        "once": _sizes(once.error(case.path)),
        "anew": _sizes(found.error(case.path)),
        "course": [
            _sizes(replace(found, legs=found.legs[: k + 1]).error(case.path)) for k in range(len(found.legs))
        ],
        "begun": [leg.begin for leg in found.legs],
        "refused": list(found.refused),
        "seconds": seconds / max(1, tried),
    }


def _sizes(error: np.ndarray) -> list[float]:
    return [float(x) for x in np.linalg.norm(np.reshape(error, (4, 3)), axis=1)]


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def met(sizes: list[float]) -> bool:
    """Whether errors are within the capture's tolerances."""
    return bool(np.all(np.asarray(sizes) <= ConvergenceTolerances().sizes))


def tables(lines: list[dict]) -> str:
    """Errors and shares, with the standard noise and more."""
    rows = [
        "| noise | captures | plan | within tolerance | " + " | ".join(WHAT) + " |",
        "|---|---|---|---|" + "---|" * 4,
    ]
    for noise in NOISES:
        cases = [line for line in lines if line["noise"] == noise and "once" in line]
        for key, name in (("once", "the first alone"), ("anew", "anew every 2.5 s")):
            errors = np.array([line[key] for line in cases]) * UNITS
            middle, high = np.median(errors, axis=0), np.quantile(errors, 0.95, axis=0)
            share = 100 * np.mean([met(line[key]) for line in cases])
            rows.append(
                f"| x {noise:g} | {len(cases)} | {name} | {share:.0f} % | "
                + " | ".join(f"{a:.2g} ({b:.2g})" for a, b in zip(middle, high, strict=True))
                + " |"
            )
    told = [line for line in lines if "once" in line]
    tried = sum(len(line["begun"]) - 1 + len(line["refused"]) for line in told)
    refused = sum(len(line["refused"]) for line in told)
    seconds = np.median([line["seconds"] for line in told])
    none = sum("once" not in line for line in lines)
    return "\n".join(rows) + (
        f"\n\nErrors in the median, and that of which 95 % stay below. {none} of {len(lines)} had no first plan. "
        f"Of {tried} times {refused} brought no new plan. A new plan took {seconds:.2f} s in the median."
    )


@styled
def draw_page(path: Path, lines: list[dict]) -> None:
    """The true error at the grasp of the plan that is followed, over the time left; a PNG."""
    figure = new_figure(2.6, 2 * WIDTH)
    axes = figure.subplots(1, 2)
    grid = np.arange(0.0, WINDOW[1], EVERY)
    drawn = []
    for index, noise in enumerate(NOISES):
        cases = [line for line in lines if line["noise"] == noise and "once" in line]
        for axis, part in zip(axes, (0, 1), strict=True):
            courses = []
            for line in cases:
                left = line["duration"] - np.array(line["begun"])
                errors = np.array(line["course"])[:, part] * UNITS[part]
                # The plan that is followed so long before the grasp is the one begun last.
                last = [np.flatnonzero(left >= t - 1e-9) for t in grid]
                courses.append([errors[k[-1]] if k.size else np.nan for k in last])
            middle = np.nanmedian(np.array(courses), axis=0)
            drawn += axis.plot(grid[:14], middle[:14], marker=".", **line_look(index))
    for axis, part in zip(axes, (0, 1), strict=True):
        axis.set(xlabel="before the grasp [s]", ylabel=f"error at the grasp: {WHAT[part]}", yscale="log")
        axis.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.yaxis.set_minor_formatter(NullFormatter())
        axis.invert_xaxis()
        axis.axhline(
            ConvergenceTolerances().sizes[part] * UNITS[part], color="0.6", linewidth=0.8, linestyle=":"
        )
    legend_above(figure, drawn[::2], [f"{noise:g} times the standard noise" for noise in NOISES])
    save_figure(figure, path.with_suffix(""), ("png",))


def main() -> None:
    """Carry out what is missing, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=25, help="captures with each noise")
    parser.add_argument("--lines", default="runs/replanning/cases.jsonl")
    parser.add_argument("--out", default="docs/benchmarks/replanning.md")
    arguments = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    keep_programs()
    kept = Path(arguments.lines)
    lines = read_lines(kept)
    for noise in NOISES:
        have = {line["number"] for line in lines if line["noise"] == noise}
        for number in first_feasible(read_seed(SEED), arguments.count):
            if number in have:
                continue
            line = judged(number, noise)
            write_line(kept, line)
            lines.append(line)
            print(noise, number, line.get("once"), line.get("anew"), flush=True)
    page = Path(arguments.out)
    fill(page, tables(lines), "Planning anew while the target becomes known")
    draw_page(page.with_suffix(".png"), lines)


if __name__ == "__main__":
    main()
