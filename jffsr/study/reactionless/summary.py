"""The summary of a reactionless study: what summary.json holds and what the command line prints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from jffsr.study.reactionless.building import ReactionlessStudy
from jffsr.study.reactionless.holding import Held
from jffsr.study.reactionless.schema import ReactionlessConfig
from jffsr.study.reactionless.schema_hold import Hold
from jffsr.study.summary import last_lines, versions

MET, NOT_HELD = 0, 1
"""Codes of the result: whether every seed of at least one run held the base."""


def reactionless_summary(
    config: ReactionlessConfig,
    study: ReactionlessStudy,
    runs: Mapping[str, Sequence[Held]],
    seconds: Mapping[str, float],
) -> dict[str, Any]:
    """The summary, plain data."""
    good = [name for name, helds in runs.items() if all(held.success for held in helds)]
    best = min(runs, key=lambda name: _median(runs[name], "base_rate"))
    rate = _median(runs[best], "base_rate")
    sentence = (
        f"The base is held still by {len(good)} of {len(runs)} runs; stillest '{best}', {rate:.2g} rad/s at the end."
        if good
        else f"No run holds the base still; of '{best}', the stillest: {runs[best][0].sentence}."
    )
    compound = study.compound
    return {
        "kind": "reactionless",
        "name": config.name,
        "robot": study.robot.name,
        "result": {
            "code": MET if good else NOT_HELD,
            "name": "held" if good else "not_held",
            "sentence": sentence,
        },
        "cost": rate,
        "terms": {},
        "contact": {
            "momentum": compound.momentum,
            "mass": float(np.sum(compound.robot.mass)),
            "base_rate": float(np.linalg.norm(compound.state.base_twist[3:])),
            "joint_velocity": compound.state.joint_velocity,
            "energy_lost": float(compound.contact.energy_lost),
        },
        "runs": {name: run_summary(config.holds[name], helds) for name, helds in runs.items()},
        "seeds": config.seeds,
        "evaluations": {"objective": 0, "gradient": 0},
        "seconds": dict(seconds),
        "seed": config.hold.seed,
        "versions": versions(),
        "verification": {
            "momentum_drift": max(momentum_drift(held) for helds in runs.values() for held in helds)
        },
    }


def run_summary(hold: Hold, helds: Sequence[Held]) -> dict[str, Any]:
    """Of all seeds: how many held the base, and medians."""
    return {
        "estimator": hold.estimator,
        "controller": hold.controller,
        "held": sum(held.success for held in helds),
        "sentence": helds[0].sentence,
        "base_rate": _median(helds, "base_rate"),
        "turned": _median(helds, "turned"),
        "mean_error": float(np.median([held.run.error.mean() for held in helds])),
        "rms_error": float(np.median([np.sqrt(np.mean(held.run.error**2)) for held in helds])),
        "peak_error": float(np.median([np.abs(held.run.error).max() for held in helds])),
    }


def hold_summary(hold: Hold, held: Held) -> dict[str, Any]:
    """What a hold came to."""
    run = held.run
    return {
        "code": int(run.code),
        "sentence": held.sentence,
        "success": held.success,
        "estimator": hold.estimator,
        "controller": hold.controller,
        "base_rate": held.base_rate,
        "turned": held.turned,
        "range_used": held.range_used,
        "largest_base_rate": float(np.linalg.norm(run.states.base_twist[:, 3:], axis=1).max()),
        "tracking_rms": float(np.sqrt(np.mean(np.square(run.error)))),
        "momentum_drift": momentum_drift(held),
    }


def momentum_drift(held: Held) -> float:
    """The largest change of any component of the momentum, N s or N m s; a blow from outside is one."""
    momentum = held.run.momentum
    return float(np.abs(momentum - momentum[0]).max())


def summary_text(summary: dict[str, Any]) -> str:
    """A summary for the terminal."""
    contact = summary["contact"]
    lines = [f"{summary['name']}: {summary['result']['sentence']}", ""]
    width = max(24, 2 + max(map(len, summary["runs"])))
    lines.append(
        f"  contact       {np.linalg.norm(contact['momentum'][3:]):.4g} N m s; base {contact['base_rate']:.3g} rad/s "
        f"right after, at {contact['mass']:.4g} kg"
    )
    lines.append(
        f"  {'run':<{width}}{'base rate':>12}{'turned':>11}{'mean error':>12}{'rms':>11}{'peak':>11}  held"
    )
    for name, run in summary["runs"].items():
        turned, errors = np.rad2deg(run["turned"]), [run[f"{key}_error"] for key in ("mean", "rms", "peak")]
        numbers = f"{run['base_rate']:>8.2e} r/s{turned:>7.2g} deg" + "".join(f"{x:>11.2e}" for x in errors)
        lines.append(f"  {name:<{width}}{numbers}  {run['held']} of {summary['seeds']}")
    return "\n".join(lines + last_lines(summary))


def _median(helds: Sequence[Held], name: str) -> float:
    return float(np.median([getattr(held, name) for held in helds]))
