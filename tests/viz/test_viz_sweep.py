"""Figures and tables of sweeps, from made-up results whose numbers are known."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray
from scipy import stats

from jffsr import cli
from jffsr.planning.result import ResultCode
from jffsr.study.dataset import save_dataset
from jffsr.study.sweep.significance import compare, holm
from jffsr.study.sweep.table import keys_of, markdown, quantile, rows_of
from jffsr.viz.style import level_look
from jffsr.viz.sweep_boxes import draw_boxes
from jffsr.viz.sweep_convergence import _held, draw_sweep_convergence
from jffsr.viz.sweep_map import draw_map

KINDS = ("qpso", "hybrid", "gradient")
DURATIONS = (15, 20, 30)
EXCURSIONS = (5.0, 10.0)
SEEDS = 6
STEPS = 4


def made_up(kinds=KINDS, durations=DURATIONS, excursions=EXCURSIONS) -> xarray.Dataset:
    """J is 10 to a power that falls with the duration and with the place of the kind, apart from a small draw."""
    rng = np.random.default_rng(4)
    points = [(k, d, e, s) for k in kinds for d in durations for e in excursions for s in range(SEEDS)]
    cost = np.array(
        [10 ** (2 - kinds.index(k) - (d - 20) / 10 + rng.uniform(0, 0.5)) for k, d, e, s in points]
    )
    spent = np.tile(10.0 * np.arange(1, STEPS + 1), (len(points), 1))
    best = cost[:, None] * 10.0 ** np.arange(STEPS - 1, -1, -1)
    columns = {
        "optimizer.kind": np.array([p[0] for p in points]),
        "task.duration": np.array([p[1] for p in points]),
        "limits.base_excursion_deg": np.array([p[2] for p in points]),
        "seed": np.array([p[3] for p in points]),
    }
    return xarray.Dataset(
        {
            "code": ("point", (cost > 1).astype(int)),
            "cost": ("point", cost),
            "evaluations": ("point", np.full(len(points), 40)),
            "gradient_evaluations": ("point", np.zeros(len(points), int)),
            "history_best_value": (("point", "step"), best),
            "history_evaluations": (("point", "step"), spent),
            "history_gradient_evaluations": (("point", "step"), 0 * spent),
            **{key: ("point", values) for key, values in columns.items()},
        },
        attrs={"swept_keys": json.dumps(list(columns)), "accuracy": 1.0, "name": "made_up", "kind": "sweep"},
    )


@pytest.fixture(scope="module")
def dataset():
    return made_up()


def test_rows_hold_every_run_of_their_setting(dataset):
    rows = rows_of(dataset)
    assert len(rows) == 18
    assert sum(row.points.size for row in rows) == dataset.sizes["point"]
    lines = markdown(dataset, ()).splitlines()
    best = np.min(dataset["cost"].values[:SEEDS])
    assert lines[2].startswith(f"| qpso | 15 | 5 | 6 | 0 | {best:.4g} |")


def test_infinite_and_missing_runs_are_told_apart(dataset):
    changed = dataset.copy(deep=True)
    changed["cost"].values[0] = np.inf
    changed["code"].values[1] = -1
    line = markdown(changed, ()).splitlines()[2].split(" | ")
    assert line[3:5] == ["5", "0"]
    assert line[9] == "inf"
    assert "infinite where the search found no motion" in markdown(changed, ())
    assert "infinite" not in markdown(dataset, ())
    assert np.isfinite(float(line[7]))


def test_pairs_are_scipys(dataset):
    [comparison] = compare(dataset, keys_of(dataset))
    assert comparison.key == "optimizer.kind"
    assert len(comparison.pairs) == 3 * len(DURATIONS) * len(EXCURSIONS)
    pair = comparison.pairs[0]
    here = (dataset["task.duration"].values == 15) & (dataset["limits.base_excursion_deg"].values == 5)
    samples = [dataset["cost"].values[here & (dataset["optimizer.kind"].values == kind)] for kind in KINDS]
    assert pair.p == pytest.approx(stats.mannwhitneyu(samples[0], samples[1]).pvalue, rel=1e-12)
    # Every hybrid is below every qpso: of C(12, 6) orders two are as extreme.
    assert pair.p == pytest.approx(2 / 924, rel=1e-9)
    assert pair.lower == 0.0
    # Three kinds always in the same order, over six settings: Friedman's statistic is at its greatest, 12.
    assert comparison.friedman == pytest.approx(stats.chi2.sf(12, 2), rel=1e-9)


def test_holm_against_a_worked_example():
    # Holm (1979): sorted p times 4, 3, 2, 1, never falling.
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.9, 0.8]) == [1.0, 1.0]


def test_equal_and_infinite_costs_are_ranked(dataset):
    changed = dataset.copy(deep=True)
    changed["cost"].values[:] = np.inf
    [comparison] = compare(changed, keys_of(changed))
    assert {pair.p for pair in comparison.pairs} == {1.0}
    assert {pair.lower for pair in comparison.pairs} == {0.5}
    assert comparison.friedman is None


def test_a_cost_bought_by_breaking_a_constraint_is_the_worst(dataset):
    changed = dataset.copy(deep=True)
    changed["cost"].values[0] = 1e-3
    changed["code"].values[0] = ResultCode.CONSTRAINTS_VIOLATED
    assert rows_of(changed)[0].cost[0] == np.inf
    pair, before = (compare(data, keys_of(data))[0].pairs[0] for data in (changed, dataset))
    assert pair.lower == before.lower == 0.0


def test_boxes_stand_at_the_runs(dataset):
    figure = draw_boxes(dataset)
    [axes] = figure.axes
    drawn = np.concatenate([line.get_xdata() for line in axes.lines if line.get_marker() in ("o", "<")])
    np.testing.assert_allclose(np.sort(drawn), np.sort(dataset["cost"].values), rtol=1e-12)
    assert len(axes.get_yticklabels()) == len(DURATIONS) * len(EXCURSIONS)
    assert draw_boxes(dataset.isel(point=slice(0, SEEDS))) is None


def test_a_run_far_below_the_accuracy_stands_at_the_end_of_the_axis(dataset):
    changed = dataset.copy(deep=True)
    changed["cost"].values[0] = 1e-14
    [axes] = draw_boxes(changed).axes
    [deep] = [line for line in axes.lines if line.get_marker() == "<" and line.get_xdata().size]
    np.testing.assert_allclose(deep.get_xdata(), 1e-4)
    assert axes.get_xlim()[0] == pytest.approx(0.7e-4)


def test_map_cells_are_medians(dataset):
    figure = draw_map(dataset)
    panels = figure.axes[: len(KINDS)]
    assert [axes.get_title() for axes in panels] == list(KINDS)
    cells = panels[1].images[0].get_array()
    assert cells.shape == (len(EXCURSIONS), len(DURATIONS))
    here = (dataset["optimizer.kind"].values == "hybrid") & (dataset["task.duration"].values == 30)
    here &= dataset["limits.base_excursion_deg"].values == 10
    assert cells[1, 2] == pytest.approx(np.median(dataset["cost"].values[here]), rel=1e-12)
    assert [text.get_text() for text in panels[0].texts] == ["0%"] * 6
    assert draw_map(made_up(excursions=(5.0,))) is None


def test_a_best_value_holds_until_a_better_one():
    spent, best = np.array([10.0, 20.0, 20.0, np.nan]), np.array([5.0, 3.0, 2.0, np.inf])
    np.testing.assert_array_equal(
        _held(spent, best, np.array([5.0, 10.0, 15.0, 20.0, 99.0])), [np.inf, 5, 5, 2, 2]
    )


def test_convergence_ends_at_the_median_of_the_runs(dataset):
    figure = draw_sweep_convergence(dataset)
    panel = figure.axes[0]
    here = (dataset["task.duration"].values == 15) & (dataset["limits.base_excursion_deg"].values == 5)
    ends = [line.get_ydata()[-1] for line in panel.lines if len(line.get_ydata()) > 2]
    expected = [
        np.median(dataset["cost"].values[here & (dataset["optimizer.kind"].values == kind)]) for kind in KINDS
    ]
    np.testing.assert_allclose(ends, expected, rtol=1e-12)


def test_convergence_of_settings_in_which_nothing_was_found(dataset, tmp_path):
    """As where no search met its constraints: such a panel says so, and of such alone there is no figure."""
    changed = dataset.copy(deep=True)
    lost = changed["task.duration"].values == 15
    changed["history_best_value"].values[lost] = np.inf
    figure = draw_sweep_convergence(changed)
    figure.savefig(tmp_path / "convergence.png")
    said = [[text.get_text() for text in axes.texts] for axes in figure.axes]
    assert said == [["no J in half of the runs"]] * 2 + [[]] * 4
    assert len(figure.axes[0].lines) == 1  # the accuracy
    changed["history_best_value"].values[:] = np.inf
    assert draw_sweep_convergence(changed) is None


def test_a_setting_whose_median_run_is_lost_is_grey_and_has_its_share(dataset, tmp_path):
    changed = dataset.copy(deep=True)
    here = (changed["optimizer.kind"].values == "qpso") & (changed["task.duration"].values == 15)
    here &= changed["limits.base_excursion_deg"].values == 5
    # Three of six: the median lies between the largest that is left and an infinite one.
    changed["cost"].values[np.flatnonzero(here)[:3]] = np.inf
    figure = draw_map(changed)
    figure.savefig(tmp_path / "map.png")
    values, lost = (image.get_array() for image in figure.axes[0].images)
    assert np.ma.is_masked(values[0, 0])
    assert [bool(cell) for cell in ~np.ma.getmaskarray(lost).ravel()] == [True] + [False] * 5
    assert len(figure.axes[0].texts) == 6
    assert figure.legends[0].get_texts()[0].get_text() == "no J in half of the runs or more"
    row = next(row for row in rows_of(changed) if row.values["task.duration"] == 15)
    assert quantile(row.cost, 0.5) == np.inf
    assert np.isfinite(quantile(row.cost, 0.25))


@pytest.mark.parametrize("share", [0.0, 0.2, 0.25, 0.5, 1.0])
def test_quantiles_of_finite_numbers_are_numpys(share):
    values = np.random.default_rng(2).normal(size=7)
    assert quantile(values, share) == pytest.approx(np.quantile(values, share), abs=1e-14)


def test_show_draws_a_sweep(dataset, tmp_path, capsys):
    save_dataset(dataset, tmp_path / "sweep.nc", {"optimizer.kind": {"dtype": "S1"}})
    summary = {"kind": "sweep", "name": "made_up", "result": {"code": 1, "sentence": "some met"}}
    (tmp_path / "summary.json").write_text(json.dumps(summary))
    (tmp_path / "table.md").write_text("| a table |\n")
    assert cli.main(["show", str(tmp_path)]) == cli.MET
    said = capsys.readouterr().out
    assert "| a table |" in said
    names = sorted(path.name for path in (tmp_path / "figures").iterdir())
    assert names == [f"{name}.{kind}" for name in ("boxes", "convergence", "map") for kind in ("pdf", "png")]
    (tmp_path / "sweep.nc").write_bytes(b"half")
    assert cli.main(["show", str(tmp_path)]) == cli.BAD_INPUT
    assert "cannot be read" in capsys.readouterr().err


def test_choices_look_different_in_colour_or_pattern():
    looks = [level_look(k) for k in range(36)]
    assert len({(look["color"], str(look["linestyle"])) for look in looks}) == 36
