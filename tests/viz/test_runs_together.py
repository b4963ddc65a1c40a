"""Several runs on one page: in what they differ, what came of them, and their curves in one plot."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest
import yaml
from made_replays import boxes_replay
from page_tables import columns_of, tables_of

from jffsr.errors import InputError
from jffsr.study.config import dump_config, load_config
from jffsr.viz.replay.replay import Panel
from jffsr.viz.report.differences import compared_runs, differences, read_run, results
from jffsr.viz.report.page import replay_page
from jffsr.viz.report.together import curves_together
from jffsr.viz.style import level_look

CONFIG = """\
kind: planning
robot: wu_6dof
task: {duration: DURATION, start_deg: [1.0, 2.0]}
optimizer: {kind: KIND}
path: {poses: [{position: [0, 0, LAST]}]}
"""


SWEEP = """\
kind: sweep
name: durations
base:
  kind: planning
  name: plan
  robot: wu_6dof
  task: {start_deg: [175, -60, -60, 0, 210, 5], goal_deg: [120, -30, -95, 40, 170, 60], duration: 30}
grid:
  task.duration: [20, 30]
seeds: [0, 1]
"""


def summary(cost: float) -> dict:
    return {
        "kind": "planning",
        "robot": "wu_2018_6dof",
        "result": {"code": 0, "sentence": f"J = {cost}"},
        "cost": cost,
        "terms": {"joint_rate": {"value": 0.01, "weighted": 0.5 * cost}},
        "evaluations": {"objective": 100, "gradient": 7},
        "seconds": {"total": 3.5, "compile": 1.0},
        "verification": {"attitude_difference_rad": 1e-7, "terms_finer": {"joint_rate": {"value": 9.0}}},
    }


def read(folder, name, cost=2.0, duration="30", kind="hybrid", last="1", **more):
    (folder / name).mkdir()
    text = CONFIG.replace("DURATION", duration).replace("KIND", kind).replace("LAST", last)
    (folder / name / "config.yaml").write_text(text)
    return read_run(folder / name, name, summary(cost) | more)


def test_only_the_keys_that_differ_are_shown(tmp_path):
    runs = [read(tmp_path, "a"), read(tmp_path, "b", duration="null", last="2")]
    table = tables_of(differences(runs))[0]
    assert table[0] == ["key", "a", "b"]
    assert table[1:] == [["task.duration", "30", "–"], ["path.poses.1.position", "0, 0, 1", "0, 0, 2"]]
    assert tables_of(differences([runs[0], read(tmp_path, "c")])) == []


def test_a_sweep_has_all_values_of_the_keys_that_it_sets(tmp_path):
    (tmp_path / "s").mkdir()
    (tmp_path / "s" / "config.yaml").write_text(SWEEP)
    sweep = read_run(tmp_path / "s", "s", {"kind": "sweep", "result": {"sentence": "1 of 4"}})
    (tmp_path / "a").mkdir()
    own = tmp_path / "own.yaml"
    own.write_text(yaml.safe_dump(yaml.safe_load(SWEEP)["base"]))
    (tmp_path / "a" / "config.yaml").write_text(dump_config(load_config(own)))
    run = read_run(tmp_path / "a", "a", summary(2.0))
    rows = tables_of(differences([sweep, run]))[0][1:]
    assert [row for row in rows if row[0] != "name"] == [
        ["task.duration", "20, 30", "30"],
        ["seed", "0, 1", "0"],
    ]
    assert tables_of(results([sweep, run]))[0][1] == ["result", "1 of 4", "J = 2.0"]


def test_keys_that_only_some_runs_have_are_folded_where_there_are_many(tmp_path):
    one, other = read(tmp_path, "a"), read(tmp_path, "b", duration="20")
    own = replace(other, config={**other.config, **{f"planner.key{number}": number for number in range(100)}})
    html = differences([one, own])
    seen, folded = tables_of(html)
    assert [row[0] for row in seen[1:]] == ["task.duration"]
    assert len(folded) == 101
    assert "<summary>100 keys" in html
    assert "<details>" not in differences([one, other])


def test_a_number_and_a_text_like_it_differ(tmp_path):
    runs = [read(tmp_path, "a", kind="7"), read(tmp_path, "b", kind="'7'")]
    assert [row[0] for row in tables_of(differences(runs))[0][1:]] == ["optimizer.kind"]


def test_what_came_of_runs_stands_side_by_side(tmp_path):
    near = {
        "nearest_approach": [{"sentence": "hand and base, 0.1 m at 3 s"}],
        "base": {"final_turn_rad": 0.5},
    }
    other = read(tmp_path, "b", cost=0.25, **near, hold={"code": 3, "base_rate": 0.002, "sentence": "still"})
    columns = columns_of(tables_of(results([read(tmp_path, "a"), other]))[0])
    found = dict(zip(columns[""], zip(columns["a"], columns["b"], strict=True), strict=True))
    assert found["result"] == ("J = 2.0", "J = 0.25")
    assert found["index J"] == ("2", "0.25")
    assert found["term joint rate, weighted"] == ("1", "0.125")
    assert found["attitude difference [rad]"] == ("1e-07", "1e-07")
    assert found["nearest approach, 1"] == ("–", "hand and base, 0.1 m at 3 s")
    assert found["base, final turn [deg]"] == ("–", "28.65")
    # What only one of them has is missing in the other.
    assert found["hold, base rate [rad/s]"] == ("–", "0.002")
    assert not any("code" in name or "finer" in name for name in found)


def test_a_configuration_that_cannot_be_read_is_said_to_be(tmp_path):
    (tmp_path / "config.yaml").write_text("{")
    with pytest.raises(InputError, match="cannot be read"):
        read_run(tmp_path, "a", summary(1.0))


def moved(title: str, end: float, **panels: Panel):
    """A replay until `end`, s, with panels of its own behind those of all."""
    replay = boxes_replay(title, duration=end)
    return replace(replay, panels=(*replay.panels, *panels.values()))


def test_each_shared_curve_has_a_plot_with_a_line_of_every_motion():
    time = np.linspace(0.0, 2.0, 5)
    alone = Panel("alone", "deg", time, {"angle": time})
    html = curves_together([moved("first", 2.0, alone=alone), moved("<second>", 3.0)])
    assert re.findall(r"<h3>([^<]*)</h3>", html) == ["place [m]", "left [m]"]
    assert re.findall(r"<figcaption>([^<]*)<", html) == ["x", "y", "left"]
    assert "&lt;second&gt;" in html
    assert "<second>" not in html
    colours = [level_look(number)["color"].lower() for number in range(2)]
    for plot in re.findall(r"<figure.*?</figure>", html, re.DOTALL):
        assert all(colour in plot.lower() for colour in colours)
    first = re.search(r'clip-path="[^"]*" style="[^"]*' + colours[0], html, re.IGNORECASE)
    assert first


def test_the_longer_motion_goes_on_where_the_shorter_has_ended():
    html = curves_together([moved("first", 1.0), moved("second", 2.0)])
    plot = re.search(r"<figure.*?</figure>", html, re.DOTALL)[0]
    ends = []
    for number in range(2):
        colour = level_look(number)["color"]
        path = re.search(rf'd="([^"]*)"[^>]*style="[^"]*{colour}', plot, re.IGNORECASE)[1]
        ends.append([float(x) for x in re.findall(r"[ML] ([\d.]+) ", path)])
    assert ends[0][0] == ends[1][0]
    assert ends[0][-1] - ends[0][0] == pytest.approx(0.5 * (ends[1][-1] - ends[1][0]), abs=0.05)


def test_nothing_is_drawn_of_motions_that_share_nothing():
    first = boxes_replay("first")
    assert curves_together([first, replace(first, panels=())]) == ""


def test_the_page_of_two_runs_stays_small_and_asks_for_nothing(tmp_path):
    replays = [boxes_replay("a"), boxes_replay("b", duration=3.0)]
    runs = [read(tmp_path, "a"), read(tmp_path, "b", duration="20")]
    page = replay_page(replays, "a | b", compared_runs(runs, curves_together(replays)))
    outer = re.sub(r'srcdoc="[^"]*"', "", page)
    assert re.findall(r"<h2>([^<]*)</h2>", outer) == [
        "In what they differ",
        "What came of them",
        "Their curves together",
    ]
    names = re.findall(r' id="([^"]+)"', outer)
    assert len(names) == len(set(names))
    assert not re.search(r'(src|href)="(?!data:|#)', outer)
    assert len(page) < 3e6
    # The script still finds its numbers.
    assert json.loads(re.search(r'id="replay-data">(.*?)</script>', page, re.DOTALL)[1])["plots"]


def test_a_page_says_what_its_colours_mean():
    page = re.sub(r'srcdoc="[^"]*"', "", replay_page([boxes_replay()], "one"))
    legend = re.search(r'<ul class="legend">(.*?)</ul>', page, re.DOTALL)[1]
    amber, red = re.findall(r"rgb\((\d+), (\d+), (\d+)\)", legend)
    assert int(red[0]) > 2 * int(red[1])
    assert int(amber[1]) > 2 * int(red[1])
    assert "at a limit or beyond it" in legend
    free = boxes_replay()
    free = replace(free, solids=tuple(replace(solid, nearness=None) for solid in free.solids))
    assert "at a limit" not in re.sub(r'srcdoc="[^"]*"', "", replay_page([free], "one"))
