"""The chains' page: what became of chains that were run again, counted from records made up by hand."""

from __future__ import annotations

import json

from experiments.chain.page import line
from experiments.chain.ranges import found_in, tables


def chain(code, sentence="", **hold):
    contact = {"momentum": [9.0, 9.0, 9.0, 0.0, 3.0, 4.0]}
    approach = {"grasp_error": {"position_m": 0.001}} if hold else None
    return {
        "result": {"code": code, "sentence": sentence},
        "approach": approach,
        "contact": contact if hold else None,
        "hold": hold or None,
    }


def held(code, rate, used):
    return chain(code, f"code {code}", base_rate=rate, turned=0.01, range_used=used)


def test_a_line_keeps_the_angular_momentum_and_the_range_used():
    found = line(held(0, 1e-6, 0.97))
    assert found["momentum"] == 5.0
    assert found["range_used"] == 0.97
    assert set(line(chain(1))) == {"code", "sentence"}


def test_chains_run_again_are_counted_by_what_they_were(tmp_path):
    """Three that had left a range, of which two stay inside; two that had been held, of which one is run again."""
    recorded = {n: {"number": n} | line(held(4 if n < 4 else 0, 1e-6, 1.0)) for n in range(1, 6)}
    recorded[9] = {"number": 9} | line(chain(1))
    for number, summary in {
        1: held(0, 3e-6, 0.95),
        2: held(0, 1e-6, 0.99),
        3: held(4, 2e-6, 1.5),
        4: held(0, 5e-6, 0.5),
    }.items():
        folder = tmp_path / f"{number:04d}"
        folder.mkdir()
        (folder / "summary.json").write_text(json.dumps(summary))
    # Under way still.
    (tmp_path / "0005").mkdir()
    again = found_in(tmp_path)
    assert sorted(again) == [1, 2, 3, 4]
    again[3]["used"] = {"with": [0.99, 1.5, 0.9], "without": [0.99, 1.7, 1.6], "braked": 1.25}
    rows = [row for row in tables(recorded, again).splitlines() if row.startswith("| ")]
    assert rows[1].startswith("| a joint left its range: 3 | 3 | 2 | 1 | 0 | 0.001, 0.002 |")
    assert rows[2].startswith("| grasped and held: 2 | 1 | 1 | 0 | 0 | 0.001, 0.005 |")
    assert rows[4:] == ["| 3 | 5.00 | 0.99000 | 1.70000 | 1.50000 | 1.25000 | 1.60000 | 0.90000 |"]
