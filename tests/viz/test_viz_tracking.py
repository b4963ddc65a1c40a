"""Figures of tracked motions: what is drawn is what was given, in its unit, with singular stretches marked."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from jffsr.errors import InputError
from jffsr.tracking.singularity.along import singularities
from jffsr.tracking.singularity.between import Postures
from jffsr.viz.tracked_run import TrackedRun, tracked_run
from jffsr.viz.tracking import (
    draw_pose_errors,
    draw_singular_values,
    draw_tracked_joints,
    save_tracking_figures,
)
from jffsr.viz.tracking_panels import near_stretches
from jffsr.viz.tracking_path import draw_tool_path

SAMPLES = 41


def made_up(size=1.0, planar=False, joints=6) -> TrackedRun:
    """Ten seconds along a line of 0.5 m, off by up to 4 mm and 1 deg; near a singularity from 4 s to 6 s."""
    time = np.linspace(0, 10, SAMPLES)
    share = time / 10
    target = np.stack([1 + 0.4 * share, 0.3 * share, 0.0 * share if planar else 0.1 * share], axis=1)
    bump = size * np.sin(np.pi * share)[:, None]
    error = np.concatenate(
        [bump * [0.004, -0.002, 0.0 if planar else 0.001], bump * np.deg2rad([1, 0.5, -1])], axis=1
    )
    quaternion = np.tile([1.0, 0, 0, 0], (SAMPLES, 1))
    values = np.tile([2.0, 1.5, 1.0, 0.8, 0.5, 0.3], (SAMPLES, 1))
    values[:, 5] = np.abs(time - 5.0) / 10
    return TrackedRun(
        time=time,
        target_position=target,
        target_quaternion=quaternion,
        tool_position=target + error[:, :3],
        tool_quaternion=quaternion,
        error=error,
        singular_values=values,
        determinant=1.2 * (time - 5.0) / 10,
        joint_position=np.sin(share)[:, None] + np.arange(joints) / 3,
        joint_velocity=size * 0.1 * np.cos(share)[:, None] * np.ones(joints),
        singular_times=(5.0,),
        threshold=0.09999,
    )


def legend_texts(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def curves(axes):
    return [line for line in axes.lines if line.get_gid() is None and len(line.get_xdata()) == SAMPLES]


def shaded(axes):
    return [patch for patch in axes.patches if patch.get_gid() == "near"]


def test_errors_in_six_directions_and_their_units():
    run = made_up()
    figure = draw_pose_errors(run)
    position, attitude = figure.axes
    assert (position.get_ylabel(), attitude.get_ylabel()) == ("position error [mm]", "attitude error [deg]")
    assert attitude.get_xlabel() == "time [s]"
    for axes, expected in ((position, 1e3 * run.error[:, :3]), (attitude, np.rad2deg(run.error[:, 3:]))):
        drawn = np.stack([line.get_ydata() for line in curves(axes)], axis=1)
        np.testing.assert_allclose(drawn, expected)
    assert legend_texts(figure)[:3] == ["x", "y", "z"]
    far = replace(run, error=100 * run.error)
    assert draw_pose_errors(far).axes[0].get_ylabel() == "position error [m]"


def test_near_singular_stretches_and_instants_are_marked():
    run = made_up()
    ((start, end),) = near_stretches(run)
    np.testing.assert_allclose([start, end], [4.125, 5.875])
    for figure in (draw_pose_errors(run), draw_singular_values(run), draw_tracked_joints(run)):
        for axes in figure.axes:
            (patch,) = shaded(axes)
            np.testing.assert_allclose([patch.get_x(), patch.get_x() + patch.get_width()], [4.125, 5.875])
            marks = [line for line in axes.lines if line.get_gid() == "singular"]
            assert [line.get_xdata()[0] for line in marks] == [5.0]
        assert {"near singular", "least $\\sigma$"} <= set(legend_texts(figure))
    plain = draw_pose_errors(replace(run, threshold=0.0, singular_times=()))
    assert legend_texts(plain) == ["x", "y", "z"]
    assert not shaded(plain.axes[0])


def test_several_motions_stand_side_by_side_on_one_scale():
    runs = {"damped": made_up(2.0), "adaptive": made_up(1.0)}
    for draw, rows in ((draw_pose_errors, 2), (draw_singular_values, 2), (draw_tracked_joints, 2)):
        figure = draw(runs)
        assert [axes.get_title() for axes in figure.axes[:2]] == ["damped", "adaptive"]
        assert len(figure.axes) == 2 * rows
        for row in range(rows):
            left, right = figure.axes[2 * row : 2 * row + 2]
            assert left.get_ylim() == right.get_ylim()


def test_a_motion_that_runs_away_is_cut_off_and_says_so():
    runs = {"inverse": made_up(200.0), "adaptive": made_up(1.0)}
    figure = draw_tracked_joints(runs)
    rates = figure.axes[2:]
    assert rates[0].get_ylim()[1] < 10
    (text,) = [text.get_text() for text in rates[0].texts if text.get_gid() == "cut off"]
    assert float(text.rsplit(" ", 1)[1]) == pytest.approx(np.rad2deg(20.0), rel=1e-2)
    assert not [text for text in rates[1].texts if text.get_gid() == "cut off"]
    # Errors next to none are no measure for those of the others.
    errors = draw_pose_errors({"plain": made_up(1.0), "fed back": made_up(1e-5)})
    assert errors.axes[0].get_ylim()[1] > 4.0


def test_singular_values_are_logarithms_with_their_threshold():
    run = made_up()
    figure = draw_singular_values(run)
    values, determinant = figure.axes
    assert values.get_yscale() == "log"
    assert values.get_ylim()[0] > 0
    drawn = np.stack([line.get_ydata() for line in curves(values)], axis=1)
    # The zero in the middle is drawn at the bottom; everything else where it is.
    middle = SAMPLES // 2
    np.testing.assert_allclose(
        np.delete(drawn, middle, axis=0), np.delete(run.singular_values, middle, axis=0)
    )
    assert 0 < drawn[middle, 5] <= values.get_ylim()[0] * 1.01
    (level,) = [line for line in values.lines if line.get_gid() == "threshold"]
    assert level.get_ydata()[0] == run.level == 0.09999
    np.testing.assert_allclose(curves(determinant)[-1].get_ydata(), run.determinant)
    assert len(draw_singular_values(replace(run, determinant=None)).axes) == 1
    assert replace(run, threshold=None).level == pytest.approx(2.0 / 30)


def test_joints_have_limits_and_sliding_ones_rows_of_their_own():
    run = replace(
        made_up(joints=2),
        joint_names=("turn", "slide"),
        joint_slides=np.array([False, True]),
        velocity_limit=np.array([0.1, 0.1]),
    )
    figure = draw_tracked_joints(run)
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert labels == ["joint angle [deg]", "rate [deg/s]", "joint travel [m]", "rate [m/s]"]
    np.testing.assert_allclose(curves(figure.axes[0])[0].get_ydata(), np.rad2deg(run.joint_position[:, 0]))
    np.testing.assert_allclose(curves(figure.axes[3])[0].get_ydata(), run.joint_velocity[:, 1])
    limits = [
        sorted(line.get_ydata()[0] for line in figure.axes[i].lines if line.get_gid() == "limit")
        for i in (1, 3)
    ]
    np.testing.assert_allclose(limits[0][-1], np.rad2deg(0.1))
    np.testing.assert_allclose(limits[1][-1], 0.1)
    assert {"turn", "slide", "limit"} <= set(legend_texts(figure))


def test_deviation_of_the_way_is_enlarged_by_what_the_legend_says():
    run = made_up()
    figure = draw_tool_path(run)
    axes = figure.axes[0]
    assert axes.name == "3d"
    (label,) = [text for text in legend_texts(figure) if "deviations" in text]
    times = float(label.strip("()").rsplit(" ", 1)[1])
    lines = [line for line in axes.lines if len(line.get_data_3d()[0]) == SAMPLES]
    expected = run.target_position + times * (run.tool_position - run.target_position)
    distances = [np.abs(np.stack(line.get_data_3d(), axis=1) - expected).max() for line in lines]
    assert min(distances) < 1e-12
    # 12 % of the path's length at most, and more than half as much with a round number.
    reach = (
        times
        * np.linalg.norm(run.error[:, :3], axis=1).max()
        / np.linalg.norm(run.target_position[-1] - [1, 0, 0])
    )
    assert 0.04 < reach <= 0.12
    assert not any("deviations" in text for text in legend_texts(draw_tool_path(run, exaggeration=1)))


def test_near_stretch_of_the_way_is_drawn_in_colour():
    run = made_up(planar=True)
    figure = draw_tool_path({"one": run}, exaggeration=1)
    axes = figure.axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [m]", "y [m]")
    (underlay,) = [line for line in axes.lines if line.get_linewidth() > 3]
    np.testing.assert_array_equal(np.isfinite(underlay.get_xdata()), run.near)
    assert "near singular" in legend_texts(figure)
    (mark,) = [line for line in axes.lines if line.get_marker() == "x"]
    np.testing.assert_allclose(np.ravel(mark.get_xdata()), run.tool_position[SAMPLES // 2, 0], atol=1e-12)


def test_a_motion_that_is_not_finite_is_drawn_as_far_as_it_goes():
    run = made_up()
    broken = {
        name: np.array(getattr(run, name))
        for name in ("error", "tool_position", "singular_values", "determinant")
    }
    for values in broken.values():
        values[30:] = np.nan
    run = replace(run, **broken)
    for draw in (draw_pose_errors, draw_singular_values, draw_tracked_joints, draw_tool_path):
        figure = draw({"lost": run, "kept": made_up()})
        figure.canvas.draw()


def test_a_perfect_tool_is_drawn_too():
    run = made_up(0.0)
    for draw in (draw_pose_errors, draw_tool_path, draw_tracked_joints):
        draw(run).canvas.draw()


def test_files(tmp_path):
    paths = save_tracking_figures(made_up(), tmp_path / "figures", kinds=["png"])
    assert [path.name for path in paths] == [
        "tool_path.png",
        "pose_errors.png",
        "singular_values.png",
        "tracked_joints.png",
    ]
    assert all(path.stat().st_size > 5000 for path in paths)


def test_run_from_a_result_its_robot_and_its_report(robots):
    robot = robots["hu_2011_planar2"]
    time = np.linspace(0, 1, 11)
    joints = np.stack([np.ones(11), 0.45 - time], axis=1)
    report = singularities(robot, Postures(time, joints), directions=("x", "y"), base_mode="fixed")
    like = made_up()
    tracked = SimpleNamespace(
        motion=SimpleNamespace(
            time=time, joint_position=joints, joint_velocity=np.tile([0.0, -1.0], (11, 1))
        ),
        target_position=like.target_position[:11],
        target_quaternion=like.target_quaternion[:11],
        tool_position=like.tool_position[:11],
        tool_quaternion=like.tool_quaternion[:11],
        pose_error=like.error[:11],
        singular_values=report.singular_values,
        determinant=report.determinant,
    )
    run = tracked_run(tracked, robot, report)
    np.testing.assert_allclose(run.singular_times, [0.45], atol=1e-6)
    assert run.level == report.threshold
    assert run.names == robot.joint_names
    np.testing.assert_array_equal(run.near, report.near)
    plain = tracked_run(tracked)
    assert plain.names == ("joint1", "joint2")
    assert all(np.isinf(limit).all() for limit in plain.limits("joint_velocity"))


def test_what_cannot_be_drawn_is_refused():
    with pytest.raises(InputError, match="no tracked motion"):
        draw_pose_errors({})
    with pytest.raises(InputError, match="'adaptive' has 'errors'; allowed are determinant, error"):
        draw_pose_errors({"adaptive": {"errors": 1}})
    with pytest.raises(InputError, match="exaggeration is 0"):
        draw_tool_path(made_up(), exaggeration=0)
