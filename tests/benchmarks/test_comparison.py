"""The comparison of optimizers: every search fits its budget, every scenario can be built, a run is kept and read."""

from __future__ import annotations

import json

import numpy as np
import pytest

from experiments import parametrisation
from experiments.comparison.page import tables
from experiments.comparison.scenarios import SCENARIOS
from experiments.comparison.searches import MEMBERS, SEARCHES, STARTS
from experiments.comparison.work import pack, read_runs, unpack
from experiments.pages import BEGIN, END, fill

BUDGET, CHARGE = 5000, 3.5


@pytest.mark.parametrize("search", SEARCHES, ids=lambda search: search.label)
def test_a_search_spends_its_budget_and_no_more(search):
    """A generation charges its members, a step of a descent its starts' gradients."""
    spent = 0.0
    for phase in search.phases(BUDGET, CHARGE):
        iterations = float(phase.stop.iterations)
        if phase.name in ("gradient", "polish"):
            spent += iterations * STARTS * CHARGE
        else:
            spent += iterations * MEMBERS
            if search.kind == "memetic":
                downhill = iterations // search.options["period"] * search.options["steps"]
                spent += downhill * STARTS * CHARGE
    assert 0.95 * BUDGET <= spent <= BUDGET


@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda scenario: scenario.name)
def test_a_scenario_is_a_problem_with_a_finite_box(scenario):
    lower, upper = scenario.problem().bounds()
    assert np.all(np.isfinite(lower))
    assert np.all(lower < upper)


def test_laws_have_the_numbers_that_their_names_say():
    for scenario in parametrisation.scenarios():
        task, _, each_joint = scenario.name.split(", ")
        free = len(scenario.problem().bounds()[0])
        assert free == int(each_joint) * {"Hu torque": 2, "wu6 tight": 6}[task]


def test_runs_are_read_as_they_were_kept_and_become_a_page(tmp_path):
    machine = {"processor": "P", "cores": 2, "versions": {"jax": "0"}}
    lines = [
        {"machine": machine, "budget": 100, "members": 50, "starts": 4},
        {"scenario": "a", "about": "one", "free": 3, "gradient_charge": 2.5},
        {"scenario": "a", "search": "x", "seed": 0, "charged": [50.0, 100.0], "best": [None, 2.0]},
        {"scenario": "a", "search": "y", "seed": 0, "charged": [50.0, 100.0], "best": [5.0, 3.0]},
    ]
    kept, page = tmp_path / "runs.jsonl", tmp_path / "page.md"
    kept.write_text("".join(json.dumps(line) + "\n" for line in lines))
    runs, facts = read_runs(kept)
    assert [run.final for run in runs] == [2.0, 3.0]
    assert runs[0].best[0] == np.inf
    page.write_text(f"before\n{BEGIN}\nold\n{END}\nafter\n")
    fill(page, tables(runs, facts), "Optimizers on robots")
    text = page.read_text()
    assert text.startswith("before")
    assert text.endswith("after\n")
    assert "old" not in text
    assert "| x | 1 | 1 |" in text
    assert "| y | 0 | 0 |" in text


def test_packed_runs_come_back_but_never_over_newer_ones(tmp_path):
    kept, packed, again = tmp_path / "runs.jsonl", tmp_path / "runs.jsonl.gz", tmp_path / "new" / "runs.jsonl"
    kept.write_text('{"machine": 1}\n')
    pack(kept, packed)
    first = packed.read_bytes()
    unpack(packed, again)
    assert again.read_bytes() == kept.read_bytes()
    kept.write_text('{"machine": 2}\n')
    unpack(packed, kept)
    assert kept.read_text() == '{"machine": 2}\n'
    pack(again, packed)
    assert packed.read_bytes() == first
