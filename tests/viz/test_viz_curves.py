"""Curves over time: units on the axes, limits only where they matter, room for the legend."""

from __future__ import annotations

import matplotlib
import numpy as np
import pytest
from viz_runs import run_dataset

from jffsr.viz.base import draw_base
from jffsr.viz.joints import draw_joints
from jffsr.viz.style import WIDTH, line_look


def marked(axes, what):
    """The heights of the horizontal lines that stand for `what`."""
    return sorted(line.get_ydata()[0] for line in axes.lines if line.get_gid() == what)


def legend_texts(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_panels_and_their_units():
    figure = draw_joints(run_dataset())
    assert [axes.get_ylabel() for axes in figure.axes] == [
        "joint angle [deg]",
        "rate [deg/s]",
        "acceleration [deg/s²]",
    ]
    assert figure.axes[-1].get_xlabel() == "time [s]"
    assert figure.get_figwidth() == WIDTH
    curve = figure.axes[1].lines[0].get_ydata()
    np.testing.assert_allclose(curve[0], np.rad2deg(np.pi / 10))


def test_no_limit_where_none_is_finite():
    figure = draw_joints(run_dataset())
    assert not any(marked(axes, "limit") for axes in figure.axes)
    assert "limit" not in legend_texts(figure)


def test_limit_near_the_curves_is_drawn_and_shaded():
    figure = draw_joints(run_dataset(rate_limit=np.deg2rad(20.0)))
    rates = figure.axes[1]
    np.testing.assert_allclose(marked(rates, "limit"), [-20.0, 20.0])
    assert len(rates.patches) == 2
    assert "limit" in legend_texts(figure)


def test_limit_far_away_does_not_squash_the_curves():
    figure = draw_joints(run_dataset(rate_limit=np.deg2rad(500.0)))
    assert marked(figure.axes[1], "limit") == []
    assert figure.axes[1].get_ylim()[1] < 25.0


def test_limit_of_some_joints_names_them():
    limits = np.deg2rad([20.0, 20.0, 20.0, 100.0, 100.0, 100.0])
    figure = draw_joints(run_dataset(rate_limit=limits))
    assert {text.get_text() for text in figure.axes[1].texts} == {"joint1 … joint3"}


def test_limit_of_joints_with_long_names_stays_short():
    names = [f"left_shoulder_pitch_{i}" for i in range(4)]
    run = run_dataset(joints=names, rate_limit=np.deg2rad([20.0, 100.0, 20.0, 20.0]))
    assert {text.get_text() for text in draw_joints(run).axes[1].texts} == {
        "left_shoulder_pitch_0 and 2 more"
    }


@pytest.mark.parametrize("count", [1, 14])
def test_legend_keeps_off_the_panels(count):
    figure = draw_joints(run_dataset(joints=count, rate_limit=np.deg2rad(20.0)))
    figure.canvas.draw()
    legend = figure.legends[0].get_window_extent()
    assert len(legend_texts(figure)) == count + 1
    assert legend.x0 >= 0
    assert legend.x1 <= figure.bbox.x1
    for axes in figure.axes:
        assert axes.get_tightbbox().y1 <= legend.y0
        assert axes.bbox.height > 50


def test_legend_reads_row_by_row():
    figure = draw_joints(run_dataset(joints=7))
    figure.canvas.draw()
    placed = sorted(
        (-round(box.y0), box.x0, text.get_text())
        for text in figure.legends[0].get_texts()
        for box in [text.get_window_extent()]
    )
    assert [name for _, _, name in placed] == [f"joint{i + 1}" for i in range(7)]


def test_sliding_joints_have_panels_in_metres():
    figure = draw_joints(run_dataset(joints=["turn", "slide"]), prismatic=[False, True])
    assert [axes.get_ylabel() for axes in figure.axes[3:]] == [
        "joint travel [m]",
        "rate [m/s]",
        "acceleration [m/s²]",
    ]
    np.testing.assert_allclose(figure.axes[3].lines[0].get_ydata(), run_dataset(2)["joint_position"][:, 1])


def test_a_joint_that_never_moves_and_a_motion_that_is_not_finite():
    run = run_dataset()
    run["joint_velocity"][:] = 0.0
    run["joint_acceleration"][:] = np.nan
    figure = draw_joints(run)
    figure.canvas.draw()
    assert all(np.isfinite(axes.get_ylim()).all() for axes in figure.axes)


def test_base_panels_units_and_excursion():
    figure = draw_base(run_dataset(excursion_limit=np.deg2rad(6.0)))
    attitude, moved = figure.axes
    assert attitude.get_ylabel() == "attitude angle [deg]"
    assert moved.get_ylabel() == "displacement [mm]"
    np.testing.assert_allclose(marked(attitude, "limit"), [6.0])
    assert marked(moved, "limit") == []
    assert legend_texts(draw_base(run_dataset())) == ["x", "y", "z"]


def test_large_displacement_is_in_metres():
    run = run_dataset()
    run["base_position"] = run["base_position"] * 100.0
    assert draw_base(run).axes[1].get_ylabel() == "displacement [m]"


def test_no_two_of_many_lines_look_the_same():
    assert len({str(line_look(index)) for index in range(42)}) == 42


def test_global_settings_stay_as_they_were():
    before = dict(matplotlib.rcParams)
    draw_joints(run_dataset())
    assert dict(matplotlib.rcParams) == before
