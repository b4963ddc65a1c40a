"""The summary of a chain: what summary.json holds and what the command line prints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jffsr.study.capture.building import CaptureStudy
from jffsr.study.capture.summary import capture_summary, sizes
from jffsr.study.capture.summary import summary_text as capture_text
from jffsr.study.chain.carried_out import Chain
from jffsr.study.chain.schema import ChainConfig
from jffsr.study.reactionless.summary import hold_summary


def chain_summary(
    config: ChainConfig, study: CaptureStudy, chain: Chain, seconds: Mapping[str, float]
) -> dict[str, Any]:
    """The summary, plain data: that of the capture's plan, with the stages after it."""
    summary = capture_summary(config, study, chain.planned, seconds)
    planned = summary["result"]
    return summary | {
        "kind": "chain",
        "result": {
            "code": int(chain.result.code),
            "name": chain.result.code.name.lower(),
            "sentence": chain.result.sentence,
        },
        "plan": planned,
        "approach": None if chain.approach is None else _approach(chain),
        "contact": None if chain.compound is None else _contact(chain),
        "hold": None if chain.held is None else hold_summary(config.hold, chain.held),
    }


def _approach(chain: Chain) -> dict[str, Any]:
    found = chain.approach
    return {
        "tracking": found.tracking,
        "touched": [str(contact) for contact in found.contacts],
        "grasp_error": sizes(chain.missed),
        "largest_torque": np.abs(found.joint_torque).max(axis=0),
    }


def _contact(chain: Chain) -> dict[str, Any]:
    compound = chain.compound
    contact = compound.contact
    return {
        "linear_impulse": float(np.linalg.norm(contact.impulse[:3])),
        "angular_impulse": float(np.linalg.norm(contact.impulse[3:])),
        "energy_lost": float(contact.energy_lost),
        "momentum": np.asarray(compound.momentum),
        "mass": float(np.sum(compound.robot.mass)),
        "base_rate": float(np.linalg.norm(compound.state.base_twist[3:])),
        "joint_velocity": np.asarray(compound.state.joint_velocity),
    }


def summary_text(summary: dict[str, Any]) -> str:
    """A summary for the terminal: the stages, then the plan's own."""
    head, *rest = capture_text(summary).splitlines()
    lines = [head, "", f"  plan          {summary['plan']['sentence']}"]
    approach, contact, hold = summary["approach"], summary["contact"], summary["hold"]
    if approach is not None:
        units = ("m", "rad", "m/s", "rad/s")
        parts = zip(approach["grasp_error"].values(), units, strict=True)
        lines.append(
            f"  in MuJoCo     grasp missed by {', '.join(f'{value:.2g} {unit}' for value, unit in parts)}"
        )
        lines += [f"  touched       {contact}" for contact in approach["touched"]]
    if contact is not None:
        angular = np.linalg.norm(contact["momentum"][3:])
        lines.append(
            f"  contact       impulse {contact['linear_impulse']:.3g} N s, {contact['angular_impulse']:.3g} N m s; "
            f"base {contact['base_rate']:.2g} rad/s; momentum {angular:.3g} N m s"
        )
    if hold is not None:
        lines.append(
            f"  hold          {hold['controller']}, {hold['estimator']}: base {hold['base_rate']:.2g} rad/s at the "
            f"end, turned by {np.rad2deg(hold['turned']):.2g} deg"
        )
    return "\n".join([*lines, *rest])
