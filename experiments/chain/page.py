"""The page of the chains: how many ended well, what failed in the others, and how far off each stage was."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import numpy as np

from experiments.pages import fill
from jffsr.study.chain.outcome import ChainCode

_UNITS = (
    ("position_m", "mm", 1e3),
    ("attitude_rad", "deg", np.rad2deg(1.0)),
    ("linear_velocity_m_s", "mm/s", 1e3),
    ("angular_velocity_rad_s", "deg/s", np.rad2deg(1.0)),
)
_WORDS = {
    ChainCode.HELD: "target grasped within tolerance, base held below 1e-3 rad/s",
    ChainCode.NOT_PLANNED: "no plan",
    ChainCode.TOUCHED: "touched something on the way",
    ChainCode.GRASP_MISSED: "the grasp was missed",
    ChainCode.NOT_HELD: "grasped, but not held",
}


def write_page(page: Path, summaries: dict[int, dict]) -> None:
    """Fill the page, and keep a line of every chain beside it."""
    fill(
        page, tables(list(summaries.values())), "The whole chain: from a camera's first pose to a still base"
    )
    lines = [json.dumps({"number": number} | line(summary)) for number, summary in summaries.items()]
    page.with_suffix(".jsonl").write_text("\n".join(lines) + "\n", encoding="utf-8")


def tables(summaries: list[dict]) -> str:
    """Counts, then errors and rates of those that came so far."""
    codes = Counter(ChainCode(summary["result"]["code"]) for summary in summaries)
    rows = ["| what became of it | chains |", "|---|---|"]
    rows += [f"| {_WORDS[code]} | {codes[code]} |" for code in ChainCode]
    failed = [summary for summary in summaries if summary["result"]["code"] != ChainCode.HELD]
    if failed:
        rows += ["", "What the others said:", ""]
        said = Counter(_shortened(summary["result"]["sentence"]) for summary in failed)
        rows += [f"* {count} x {sentence}" for sentence, count in said.most_common()]
    rows += ["", "| quantity | median | 95 % below | largest | of |", "|---|---|---|---|---|"]
    grasps = [summary["approach"]["grasp_error"] for summary in summaries if summary["approach"]]
    for key, unit, scale in _UNITS:
        name = key.removesuffix("_m").removesuffix("_rad").removesuffix("_m_s").removesuffix("_rad_s")
        rows.append(
            _row(f"grasp missed by, {name.replace('_', ' ')}, {unit}", [scale * g[key] for g in grasps])
        )
    holds = [(summary["contact"], summary["hold"]) for summary in summaries if summary["hold"]]
    rows.append(_row("linear impulse, N s", [contact["linear_impulse"] for contact, _ in holds]))
    rows.append(_row("momentum, N m s", [np.linalg.norm(contact["momentum"][3:]) for contact, _ in holds]))
    rows.append(_row("base rate right after, mrad/s", [1e3 * contact["base_rate"] for contact, _ in holds]))
    rows.append(_row("base rate at the end, mrad/s", [1e3 * hold["base_rate"] for _, hold in holds]))
    rows.append(_row("base turned by, deg", [np.rad2deg(hold["turned"]) for _, hold in holds]))
    return "\n".join(rows)


def _row(name: str, values: list[float]) -> str:
    if not values:
        return f"| {name} | | | | 0 |"
    low, high, most = np.median(values), np.quantile(values, 0.95), np.max(values)
    return f"| {name} | {low:.2g} | {high:.2g} | {most:.2g} | {len(values)} |"


def _shortened(sentence: str) -> str:
    """Without its numbers, which differ from chain to chain."""
    return sentence.split("(")[0].split(";")[0].split(":")[0].strip()


def line(summary: dict) -> dict:
    """What is kept of a chain beside the page."""
    kept = {"code": summary["result"]["code"], "sentence": summary["result"]["sentence"]}
    if summary["approach"]:
        kept["grasp_error"] = summary["approach"]["grasp_error"]
    if summary["hold"]:
        kept["base_rate"], kept["turned"] = summary["hold"]["base_rate"], summary["hold"]["turned"]
        kept["range_used"] = summary["hold"]["range_used"]
        kept["momentum"] = float(np.linalg.norm(summary["contact"]["momentum"][3:]))
    return kept
