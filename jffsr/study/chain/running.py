"""A chain in its folder: carried out, each stage's artefact written, and what came of it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from jffsr.parallel.processes import is_first
from jffsr.planning.stopwatch import Stopwatch
from jffsr.study.atomic import write_json
from jffsr.study.capture.building import CaptureStudy, build_study
from jffsr.study.capture.dataset import capture_dataset
from jffsr.study.chain.carried_out import Chain, carry_out
from jffsr.study.chain.dataset import approach_dataset, chain_dataset, observation_dataset
from jffsr.study.chain.schema import ChainConfig
from jffsr.study.chain.summary import chain_summary
from jffsr.study.claiming import Run, claim, shared_summary
from jffsr.study.dataset import save_dataset
from jffsr.study.reactionless.dataset import hold_dataset
from jffsr.study.run_folder import RunFolder

OBSERVATION, PLAN, APPROACH, CONTACT, HOLD = (
    "observation.nc",
    "plan.nc",
    "approach.nc",
    "contact.json",
    "hold.nc",
)
"""The artefacts of the stages, in their order."""


def run_chain(
    config: ChainConfig, out: str | Path | None, say: Callable[[str], None] = lambda text: None
) -> Run:
    """Run a chain in its folder; one that was stopped begins anew, with its compiled programs at hand.

    The study is built, and so the input checked, before the folder is touched.
    """
    study = build_study(config)
    folder, finished, _ = claim(config, out)
    if finished:
        return Run(folder, shared_summary(folder), already_finished=True)
    told = say if config.output.progress else lambda text: None
    with Stopwatch() as watch:
        chain = carry_out(config, study, told)
    if is_first():
        _finish(folder, config, study, chain, chain_summary(config, study, chain, watch.as_dict()))
    return Run(folder, shared_summary(folder))


def _finish(folder: RunFolder, config: ChainConfig, study: CaptureStudy, chain: Chain, summary: dict) -> None:
    """Write what each stage left, then the summary, which marks the run as finished."""
    planned, robot = chain.planned, study.robot
    folder.metrics.unlink(missing_ok=True)
    folder.add_metrics(**{key: summary[key] for key in ("attempts", "evaluations", "cost_before", "cost")})
    if planned.observed is not None:
        save_dataset(observation_dataset(planned.observed), folder.path / OBSERVATION)
    save_dataset(capture_dataset(config, study, planned), folder.path / PLAN)
    if chain.approach is not None:
        save_dataset(approach_dataset(robot, chain.approach), folder.path / APPROACH)
    if chain.compound is not None:
        write_json(folder.path / CONTACT, contact_record(chain))
    if chain.held is not None:
        save_dataset(hold_dataset(robot, chain.held), folder.path / HOLD)
    save_dataset(chain_dataset(robot, chain), folder.result)
    write_json(folder.summary, summary)


def contact_record(chain: Chain) -> dict:
    """The compound for a file: impulse, momentum, inertial parameters of all bodies, and the state after."""
    compound = chain.compound
    contact, state = compound.contact, compound.state
    robot = compound.robot
    return {
        "impulse": contact.impulse,
        "point": contact.point,
        "momentum_before": contact.momentum_before,
        "momentum": compound.momentum,
        "energy_lost": contact.energy_lost,
        "state": vars(state),
        "bodies": {
            "name": list(robot.body_names),
            "mass": robot.mass,
            "inertia": robot.inertia,
            "link_com": robot.link_com,
        },
    }
