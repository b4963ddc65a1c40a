"""The comparison's page says what was measured, and what its text claims."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from experiments.pages import BEGIN, END
from experiments.reactionless.control_page import tables
from experiments.reactionless.control_runs import ELM, ONES, PSO, SIMULATION, SSADE, STROKE
from jffsr.reactionless.plant_run import LoopCode

PAGE = Path(__file__).parents[2] / "docs" / "benchmarks" / "reactionless_control.md"
FACTS, _, *ROWS = [json.loads(line) for line in PAGE.with_suffix(".jsonl").read_text("utf-8").splitlines()]


def values(scene, name, key="rms"):
    return np.array([row[key] for row in ROWS if (row["scene"], row["controller"]) == (scene, name)])


def test_the_tables_are_what_was_measured():
    text = PAGE.read_text(encoding="utf-8")
    assert text.split(BEGIN)[1].split(END)[0].strip() == tables(FACTS, ROWS).strip()


def test_the_claims_of_the_text():
    for scene in (SIMULATION, STROKE):
        assert np.all(values(scene, SSADE) < values(scene, ELM))
        assert np.all(values(scene, SSADE) < values(scene, PSO))
        assert np.all(values(scene, ONES) < 0.7 * values(scene, SSADE))
        means = [np.median(values(scene, name, "mean")) for name in (SSADE, PSO, ELM)]
        assert means == sorted(means)
        codes = np.concatenate([values(scene, name, "code") for name in (SSADE, PSO, ELM)])
        assert np.all(codes == LoopCode.KEPT)
    assert values(SIMULATION, SSADE).size == FACTS["seeds"] == 20
    assert FACTS["training"][PSO] > FACTS["training"][ELM] > FACTS["training"][SSADE]
    gains = [FACTS["gain"][name] for name in (ELM, PSO, SSADE, ONES)]
    assert gains == sorted(gains)
    assert FACTS["mujoco"]["apart"] < 1e-7
