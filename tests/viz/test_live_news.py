"""What is read of a run or a sweep that is under way, from folders written by hand."""

from __future__ import annotations

import json
import os
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from jffsr.errors import InputError
from jffsr.study.config import dump_config, load_config
from jffsr.study.sweep.parts import save_part
from jffsr.study.sweep.specification import read_sweep
from jffsr.study.sweep.tasks import Task
from jffsr.viz.live.growing import GrowingLines
from jffsr.viz.live.news import Chart, News, Table, ago, curve, lasting
from jffsr.viz.live.page import table, words
from jffsr.viz.live.watching import watch_of


def line(evaluations: int, gradients: int, best: float | None, phase: str = "swarm", **more) -> str:
    values = {"phase": phase, "iteration": 1, "evaluations": evaluations, "gradient_evaluations": gradients}
    return json.dumps({**values, "best_value": best, **more}) + "\n"


@pytest.fixture
def run_folder(tmp_path) -> Path:
    """The folder of a planning run that has just begun."""
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "config.yaml").write_text(dump_config(load_config("composite_wu6")), encoding="utf-8")
    return folder


def state_of(folder: Path) -> dict[str, tuple[int, int]]:
    return {str(path): (path.stat().st_mtime_ns, path.stat().st_ino) for path in folder.rglob("*")}


def test_a_half_written_line_waits_for_its_end(tmp_path):
    path = tmp_path / "metrics.jsonl"
    lines = GrowingLines(path)
    assert lines.look() == []
    whole = '{"a": 1}\n{"a": 2}\n'
    path.write_text(whole + '{"a": 3', encoding="utf-8")
    assert lines.look() == [{"a": 1}, {"a": 2}]
    assert lines.look() == [{"a": 1}, {"a": 2}]
    path.write_text(whole + '{"a": 34}\n', encoding="utf-8")
    assert lines.look() == [{"a": 1}, {"a": 2}, {"a": 34}]


def test_a_line_in_the_middle_of_a_letter_and_a_broken_one_do_no_harm(tmp_path):
    path = tmp_path / "metrics.jsonl"
    data = '{"name": "Lösung"}\n'.encode()
    lines = GrowingLines(path)
    path.write_bytes(data[:12])
    assert lines.look() == []
    path.write_bytes(data + b'no json\n[1]\n{"b": 2}\n')
    assert lines.look() == [{"name": "Lösung"}, {"b": 2}]


@pytest.mark.parametrize("after", ['{"a": 1}\n', '{"a": 7}\n{"a": 8}\n{"a": 9}\n', ""])
def test_a_file_that_was_cut_or_written_anew_is_read_again(tmp_path, after):
    path = tmp_path / "metrics.jsonl"
    path.write_text('{"a": 1}\n{"a": 2}\n', encoding="utf-8")
    lines = GrowingLines(path)
    assert len(lines.look()) == 2
    path.write_text(after, encoding="utf-8")
    assert lines.look() == [json.loads(text) for text in after.splitlines()]
    path.unlink()
    assert lines.look() == []


def test_a_search_is_followed_as_its_metrics_grow(run_folder):
    watch = watch_of(run_folder)
    first = watch.news()
    assert (first.finished, first.charts) == (False, ())
    assert first.headline == "under way, and has noted nothing yet"
    metrics = run_folder / "metrics.jsonl"
    metrics.write_text(line(20, 0, None) + line(40, 0, 8.0) + '{"phase": "sw', encoding="utf-8")
    news = watch.news()
    assert news.headline == "under way"
    assert dict(news.facts)["best J"] == "8"
    # The first line has no value yet, the last no end.
    np.testing.assert_array_equal(news.charts[0].x, [40.0])
    metrics.write_text(
        line(20, 0, None) + line(40, 0, 8.0) + line(40, 12, 0.0625, "polish"), encoding="utf-8"
    )
    news = watch.news()
    facts = dict(news.facts)
    assert (facts["phase"], facts["best J"], facts["evaluations"], facts["gradients"]) == (
        "polish",
        "0.0625",
        "40",
        "12",
    )
    np.testing.assert_array_equal(news.charts[0].x, [40.0, 52.0])
    np.testing.assert_array_equal(news.charts[0].curves["best J"], [8.0, 0.0625])
    assert news.charts[0].logarithmic


def test_constraints_have_a_curve_of_their_own(run_folder):
    rows = line(20, 0, None, violation=0.5) + line(40, 0, 3.0, violation=0.0)
    (run_folder / "metrics.jsonl").write_text(rows, encoding="utf-8")
    news = watch_of(run_folder).news()
    assert dict(news.facts)["constraints missed by"] == "0"
    best, missed = news.charts
    np.testing.assert_array_equal(best.x, [40.0])
    np.testing.assert_array_equal(missed.curves["violation"], [0.5, 0.0])
    assert not missed.logarithmic


def test_what_is_not_a_search_is_told_in_a_table(run_folder):
    rows = [{"run": f"case {i}", "base_rate": 0.25 * i, "more": {"a": 1}} for i in range(15)]
    (run_folder / "metrics.jsonl").write_text(
        "".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8"
    )
    news = watch_of(run_folder).news()
    assert news.table.head == ("run", "base rate")
    assert news.table.rows[-1] == ("case 14", "3.5")
    assert news.table.left_out + len(news.table.rows) == 15


def test_a_finished_run_says_so_and_names_the_command(run_folder):
    watch = watch_of(run_folder)
    assert not watch.news().finished
    (run_folder / "summary.json").write_text(
        '{"result": {"code": 0, "sentence": "all is well"}}', encoding="utf-8"
    )
    news = watch.news()
    assert news.finished
    assert news.headline == "finished: all is well"
    assert news.hint == f"jffsr show {run_folder}"
    (run_folder / "summary.json").write_text("{}", encoding="utf-8")
    assert watch.news().headline == "finished"


@pytest.fixture
def sweep_folder(tmp_path) -> Path:
    """The folder of a sweep of two settings with three seeds each that has just begun."""
    folder = tmp_path / "sweep"
    (folder / "parts").mkdir(parents=True)
    spec = read_sweep("composite_wu6", ["task.duration=20,30", "seeds=3"])
    (folder / "config.yaml").write_text(spec.to_yaml(), encoding="utf-8")
    return folder


def add_part(folder: Path, numbers, code, cost, best=None) -> Path:
    """Write a finished part as a sweep does; `best` is the last value of each search."""
    count = len(numbers)
    setting = SimpleNamespace(mark="m")
    task = Task(tuple(numbers), (setting,) * count, tuple(range(count)), ("",) * count, count)
    last = np.asarray(cost if best is None else best, float)[:, None]
    results = {"code": np.array(code), "cost": np.array(cost, float), "history_best_value": last}
    save_part(folder / "parts", task, results)
    return folder / "parts" / f"{numbers[0]:07d}.npz"


def test_the_points_of_a_sweep_are_counted_from_its_parts(sweep_folder):
    from jffsr.planning.result import ResultCode

    met, missed, broken = (
        ResultCode.ACCURACY_MET,
        ResultCode.ACCURACY_NOT_MET,
        ResultCode.CONSTRAINTS_VIOLATED,
    )
    watch = watch_of(sweep_folder)
    assert watch.news().headline == "under way, no point is finished yet"
    os.utime(add_part(sweep_folder, [0, 1], [met, missed], [0.5, 4.0]), (2e9, 2e9))
    news = watch.news()
    assert news.share == pytest.approx(2 / 6)
    assert dict(news.facts)["finished"] == "2, of which 1 met their accuracy and 1 did not"
    assert dict(news.facts)["still to come"] == "4"
    # What breaks a constraint, or never kept all of them, has no J.
    os.utime(
        add_part(sweep_folder, [3, 4, 5], [broken, met, missed], [0.1, 0.25, 0.2], [1, 1, np.inf]),
        (2e9 + 9,) * 2,
    )
    (sweep_folder / "parts" / ".0000002.npz.77.part").write_bytes(b"half of")
    (sweep_folder / "parts" / "0000002.npz").write_bytes(b"no part")
    news = watch.news()
    assert news.share == pytest.approx(5 / 6)
    assert news.table.rows == (
        ("task.duration=20", "2 of 3", "1", "0.5"),
        ("task.duration=30", "3 of 3", "1", "0.25"),
    )
    finished, best = news.charts
    np.testing.assert_array_equal(finished.curves["finished"], np.arange(6.0))
    assert np.ptp(finished.x[1:]) > 0
    np.testing.assert_array_equal(best.curves["best J"], [0.5, 0.5, 0.5, 0.25, 0.25])


def test_a_point_that_is_computed_again_replaces_the_first(sweep_folder):
    watch = watch_of(sweep_folder)
    path = add_part(sweep_folder, [0], [0], [2.0])
    assert watch.news().table.rows[0][3] == "2"
    path.unlink()
    assert watch.news().share == 0.0
    os.utime(add_part(sweep_folder, [0], [0], [1.5]), (2e9, 2e9))
    assert watch.news().table.rows[0][3] == "1.5"


def test_a_sweep_that_ended_says_how(sweep_folder):
    watch = watch_of(sweep_folder)
    add_part(sweep_folder, [0], [0], [2.0])
    (sweep_folder / "sweep.nc").write_bytes(b"")
    assert watch.news().headline.startswith("5 points could not be computed so far")
    (sweep_folder / "summary.json").write_text('{"result": {"sentence": "6 of 6"}}', encoding="utf-8")
    assert watch.news().headline == "finished: 6 of 6"
    assert watch.news().hint == f"jffsr show {sweep_folder}"


@pytest.mark.parametrize("kind", ["run_folder", "sweep_folder"])
def test_watching_changes_nothing(kind, request):
    folder = request.getfixturevalue(kind)
    (folder / "metrics.jsonl").write_text(line(20, 0, 3.0) + "{", encoding="utf-8")
    if kind == "sweep_folder":
        (folder / "parts" / ".0000000.npz.77.part").write_bytes(b"half of a part")
        (folder / "parts" / "0000001.npz").write_bytes(b"damaged")
    before = state_of(folder)
    watch_of(folder).news()
    assert state_of(folder) == before


def test_what_is_neither_run_nor_sweep_is_refused(tmp_path, capsys):
    from jffsr import cli

    file = tmp_path / "file.txt"
    file.write_text("x", encoding="utf-8")
    empty = tmp_path / "empty"
    empty.mkdir()
    for path, word in ((tmp_path / "none", "no such folder"), (file, "is a file"), (empty, "no config.yaml")):
        with pytest.raises(InputError, match=word):
            watch_of(path)
        assert cli.main(["watch", str(path), "--no-browser"]) == cli.BAD_INPUT
        told = capsys.readouterr().err
        assert word in told
        assert told.count("\n") == 1


def test_a_long_curve_is_thinned_to_its_ends():
    x = np.arange(50_000.0)
    found = curve("J", "x", "J", x, -x)
    assert len(found.x) == 600
    assert (found.x[0], found.x[-1], found.curves["J"][-1]) == (0.0, 49_999.0, -49_999.0)
    assert curve("J", "x", "J", [1.0], [np.nan]) is None


def test_lengths_of_time_are_told_in_two_units():
    assert [lasting(s) for s in (0, 59.9, 60, 3601, 90061)] == [
        "0 s",
        "59 s",
        "1 min 0 s",
        "1 h 0 min",
        "1 d 1 h",
    ]
    assert ago(None) == "not yet"
    assert ago(100.0, now=223.0) == "2 min 3 s ago"


def test_an_axis_is_logarithmic_where_that_shows_more():
    def chart(values):
        return Chart("J", "x", np.arange(len(values)), {"J": np.array(values, float)})

    assert chart([1.0, 1e-6]).logarithmic
    assert not any(chart(values).logarithmic for values in ([1.0, 0.0], [-1.0, 2.0], [3.0, 3.1], [2.0]))


def test_the_words_of_the_page():
    news = News("under way", False, (("name", "a|b"),), table=Table(("h",), (("1",), ("2",)), left_out=3))
    assert "### under way" in words(news)
    assert "| name | a\\|b |" in words(news)
    assert "jffsr show" not in words(news)
    assert table(news.table).splitlines()[:4] == ["| h |", "| --- |", "| 1 |", "| 2 |"]
    assert "3 more" in table(news.table)
