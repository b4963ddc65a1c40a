"""A study against uncertain robots: its summary, and what it says of it."""

from __future__ import annotations

import json

import pytest

from jffsr import cli
from jffsr.study.robust_summary import robust_lines

CONFIG = "configs/planning/composite_wu6.yaml"


def test_what_is_not_finite_is_said_to_be():
    summary = {
        "measure": "cvar",
        "value": None,
        "fresh_robots": 256,
        "quantiles": {"0.05": 1.25, "0.5": 2.0, "0.95": None},
        "share_met": 0.5,
    }
    assert robust_lines(summary) == [
        "  robust        cvar of J not finite; over 256 other robots J is 2 (1.25 to not finite for nine in ten), "
        "met by 50 %"
    ]
    assert robust_lines(None) == []


@pytest.mark.slow
def test_a_run_reports_how_its_plan_fares_on_other_robots(tmp_path, small, capsys):
    folder = tmp_path / "robust"
    asked = ("robust.samples=2", "robust.measure=worst_case")
    cli.main(["run", CONFIG, *small, *asked, "--out", str(folder)])
    summary = json.loads((folder / "summary.json").read_text())
    robust = summary["robust"]
    assert robust["samples"] == 2
    assert robust["value"] == pytest.approx(summary["cost"], rel=1e-9)
    low, middle, high = (robust["quantiles"][q] for q in ("0.05", "0.5", "0.95"))
    assert low < middle < high <= robust["worst"]
    assert "worst_case of J" in capsys.readouterr().out
