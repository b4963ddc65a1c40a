"""The robot in space: what is drawn stands where the kinematics says; files come whole."""

from __future__ import annotations

import jax
import numpy as np
import pytest
from motions import robot_from_record
from viz_runs import run_dataset

from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.robots.state import State
from jffsr.viz.convergence import draw_convergence
from jffsr.viz.motion import draw_robot
from jffsr.viz.save import save_figure, save_figures
from jffsr.viz.scene import base_box, scene_of


@pytest.fixture
def planar2(robots):
    return robots["hu_2011_planar2"]


def test_box_has_the_inertia_of_the_base(robots):
    for robot in robots.values():
        axes, sides = base_box(robot)
        squares = sides**2
        moments = robot.mass[0] / 12 * (squares.sum() - squares)
        np.testing.assert_allclose(axes @ np.diag(moments) @ axes.T, robot.inertia[0], rtol=1e-12, atol=1e-12)


def test_scene_stands_where_the_kinematics_says(robots):
    robot = robots["two_arms"]
    run = run_dataset(joints=list(robot.joint_names))
    scene = scene_of(robot, run)
    sample = 17
    values = [run[name].values[sample] for name in ("base_position", "base_quaternion", "joint_position")]

    @jax.jit
    def expected(*values):
        kin = kinematics(robot, State(*values))
        return kin, [end_effector_pose(robot, kin, name)[0] for name in robot.end_effector_names]

    kin, tools = expected(*values)
    np.testing.assert_allclose(scene.tools[sample], np.stack(tools), atol=1e-12)
    np.testing.assert_allclose(scene.joints[sample], kin.anchor, atol=1e-12)
    np.testing.assert_allclose(scene.base_faces[sample].mean(axis=(0, 1)), kin.base_position, atol=1e-12)
    assert not scene.planar
    # Every tool and every joint is an end of some segment.
    ends = scene.segments[sample].reshape(-1, 3)
    for point in [*scene.tools[sample], *scene.joints[sample]]:
        assert np.linalg.norm(ends - point, axis=1).min() < 1e-12


def test_planar_robot_is_seen_from_above(planar2):
    figure = draw_robot(planar2, run_dataset(joints=2))
    axes = figure.axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [m]", "y [m]")
    assert axes.get_aspect() == 1.0
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "0", "2.5", "5", "7.5", "10 s", "tool path",
    ]  # fmt: skip


def test_space_robot_has_one_scale_and_fits_its_figure(robots):
    robot = robots["two_arms"]
    figure = draw_robot(robot, run_dataset(joints=list(robot.joint_names)), instants=3)
    axes = figure.axes[0]
    assert [axes.get_xlabel(), axes.get_ylabel(), axes.get_zlabel()] == ["x [m]", "y [m]", "z [m]"]
    spans = np.ptp([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()], axis=1)
    np.testing.assert_allclose(axes.get_box_aspect() / spans, (axes.get_box_aspect() / spans)[0])
    figure.canvas.draw()
    box, legend = axes.get_tightbbox(), figure.legends[0].get_window_extent()
    assert box.x0 >= 0
    assert box.y0 >= 0
    assert box.x1 <= figure.bbox.x1
    assert box.y1 <= legend.y0
    assert box.width > 0.6 * figure.bbox.width


def test_one_joint_and_one_instant(oracles):
    record = oracles["planar2"].data["robot"]
    short = {**record, "links": record["links"][:2], "joints": record["joints"][:1]}
    short["end_effectors"] = []
    robot = robot_from_record(short)
    assert robot.num_joints == 1
    draw_robot(robot, run_dataset(joints=1), instants=1).canvas.draw()


def test_files_are_written_whole(planar2, tmp_path):
    folder = tmp_path / "run" / "figures"
    paths = save_figures(planar2, run_dataset(joints=2), folder)
    assert [path.name for path in paths] == [
        f"{name}.{kind}" for name in ("joints", "base", "convergence", "robot") for kind in ("png", "pdf")
    ]
    assert sorted(folder.iterdir()) == sorted(paths)
    for path in paths:
        start = b"\x89PNG" if path.suffix == ".png" else b"%PDF"
        content = path.read_bytes()
        assert content.startswith(start)
        assert len(content) > 5000


def test_only_the_forms_asked_for_are_written(planar2, tmp_path):
    paths = save_figures(planar2, run_dataset(joints=2), tmp_path, ["png"])
    assert len(paths) == 4
    assert {path.suffix for path in tmp_path.iterdir()} == {".png"}


def test_a_figure_that_fails_leaves_no_file(tmp_path, monkeypatch):
    def fail(*args):
        raise OSError("disk full")

    monkeypatch.setattr("jffsr.viz.save.os.replace", fail)
    with pytest.raises(OSError, match="disk full"):
        save_figure(draw_convergence(run_dataset()), tmp_path / "convergence")
    assert list(tmp_path.iterdir()) == []
