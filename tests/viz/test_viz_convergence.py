"""The convergence figure: what is charged, where phases change, and histories without a finite value."""

from __future__ import annotations

import numpy as np
import pytest
from viz_runs import run_dataset

from jffsr.viz.convergence import draw_convergence


def lines(axes, what):
    return [line for line in axes.lines if line.get_gid() == what]


def test_gradients_are_charged_and_phases_marked():
    figure = draw_convergence(run_dataset())
    axes = figure.axes[0]
    assert axes.get_xlabel() == "objective + gradient evaluations"
    assert axes.get_ylabel() == "best J [-]"
    assert axes.get_yscale() == "log"
    assert axes.get_xlim()[1] == 112
    assert [line.get_xdata()[0] for line in lines(axes, "phase")] == [100, 108]
    assert [line.get_ydata()[0] for line in lines(axes, "accuracy")] == [1.0]
    words = {text.get_text() for text in figure.legends[0].get_texts()}
    assert words == {"swarm: 100 J", "gradient: 8 ∇J", "polish: 4 ∇J", "end: J = 0.3"}


def test_nothing_is_drawn_before_the_first_finite_value():
    first = draw_convergence(run_dataset()).axes[0].lines[0]
    assert np.isnan(first.get_ydata()[0])
    assert first.get_ydata()[1] == 900.0


@pytest.mark.parametrize(
    ("best", "phases"),
    [((np.inf,) * 3, (0, 0, 1)), ((np.nan,), (0,)), ((), ()), ((3.0,), (0,)), ((np.inf, 0.0), (0, 1))],
)
def test_odd_histories_can_be_drawn(best, phases):
    figure = draw_convergence(run_dataset(best=best, phases=phases))
    figure.canvas.draw()
    low, high = figure.axes[0].get_ylim()
    assert 0 < low < 1.0 < high
    assert high / low >= 10


def test_a_run_without_a_finite_value_says_so():
    axes = draw_convergence(run_dataset(best=(np.inf, np.inf), phases=(0, 0))).axes[0]
    assert "no finite J was found" in [text.get_text() for text in axes.texts]


def test_what_lies_far_below_the_accuracy_does_not_flatten_the_rest():
    axes = draw_convergence(run_dataset(best=(900.0, 5.0, 1e-14), phases=(0, 0, 1))).axes[0]
    low, _ = axes.get_ylim()
    assert low > 1e-6
    end = next(line for line in axes.lines if line.get_marker() == "v")
    assert end.get_ydata()[0] == low
