"""Figures of a capture: what they draw of made-up arrays in the form of result.nc."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from capture_runs import SAMPLES, motion_dataset, scan_dataset

import jffsr
from jffsr.capture.grasp_time import GraspTimeCode
from jffsr.robots.geometry import BOX, Geometry, Shape
from jffsr.viz.capture import grasp_time_of, save_capture_figures
from jffsr.viz.capture_front import draw_front
from jffsr.viz.capture_scene import draw_capture
from jffsr.viz.capture_tool import draw_capture_tool
from jffsr.viz.clearance import draw_clearance

GEOMETRY = Geometry((Shape("hull", BOX, "target", np.zeros(3), np.eye(3), np.array([0.2, 0.3, 0.1])),))


def front_dataset() -> xr.Dataset:
    values = np.array([[0.1, 0.3], [0.2, 0.6], [0.5, 0.8]])
    chosen = np.array(["least_base_disturbance", "balanced", ""])
    return xr.Dataset(
        {"front_value": (("solution", "index"), values), "front_chosen": ("solution", chosen)},
        coords={"index": ["base_disturbance", "manipulability"]},
    )


def words(figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_the_criterion_comes_back_from_its_arrays():
    found = grasp_time_of(scan_dataset())
    assert found.success
    assert (found.candidate.grasp, found.time) == ("ring", 20.0)
    assert [scan.grasp for scan in found.scans] == ["handle", "ring"]
    assert found.scans[1].value.min() == 1.0
    none = grasp_time_of(scan_dataset(2).assign(candidate_chosen=("candidate", np.zeros(2, bool))))
    assert none.code is GraspTimeCode.NEVER_FACING
    assert none.candidate is None


def test_the_tool_is_drawn_beside_the_grasp_frame_with_its_errors():
    dataset = motion_dataset(7)
    figure = draw_capture_tool(dataset)
    position, velocity, rate, errors, slow = figure.axes
    assert [axes.get_ylabel() for axes in (position, velocity, rate)] == [
        "position [m]",
        "velocity [m/s]",
        "rate [deg/s]",
    ]
    np.testing.assert_allclose(position.lines[1].get_ydata(), dataset["tool_position"][:, 0])
    np.testing.assert_allclose(rate.lines[1].get_ydata()[0], np.rad2deg(0.04))
    length = np.linalg.norm(dataset["grasp_error"][:, :3], axis=1)
    np.testing.assert_allclose(errors.lines[0].get_ydata()[:-1], length[:-1])
    assert errors.get_yscale() == slow.get_yscale() == "log"
    assert errors.get_legend().get_texts()[0].get_text() == "position, 0.0e+00 at the end"
    true = dataset.assign(true_grasp_error=dataset["grasp_error"] + 0.01)
    labels = [text.get_text() for text in draw_capture_tool(true).axes[3].get_legend().get_texts()]
    assert "position, true, 1.7e-02 at the end" in labels


def test_the_nearest_pairs_are_named_and_the_margin_marked():
    apart = np.linspace(1.0, 0.1, SAMPLES) + np.arange(8)[:, None]
    dataset = xr.Dataset(
        {"clearance": (("pair", "time"), apart[::-1])},
        coords={"pair": [f"link{i} and target" for i in range(8)], "time": np.linspace(0, 20, SAMPLES)},
        attrs={"margin": 0.02},
    )
    figure = draw_clearance(dataset)
    assert words(figure)[0] == "link7 and target"
    assert sorted(words(figure))[-2:] == ["margin", "others"]
    (axes,) = figure.axes
    assert 0.02 in [line.get_ydata()[0] for line in axes.lines]
    assert axes.get_ylim()[0] == 0.0


def test_a_front_is_in_order_with_its_chosen_solutions():
    figure = draw_front(front_dataset())
    (axes,) = figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("base disturbance [-]", "manipulability [-]")
    assert words(figure) == ["solution", "least base disturbance", "balanced"]
    assert axes.lines[0].get_xdata().tolist() == [0.1, 0.2, 0.5]
    assert axes.lines[2].get_xydata().tolist() == [[0.2, 0.6]]


@pytest.fixture(scope="module")
def robot():
    return jffsr.load_robot("servicer_7dof")


def test_robot_and_target_are_drawn_three_times(robot):
    figure = draw_capture(robot, GEOMETRY, motion_dataset(7))
    assert [axes.get_title() for axes in figure.axes] == ["0 s", "10 s", "20 s"]
    # The tool's way so far: nothing yet at the start, all of it at the end.
    ways = [axes.lines[1].get_data_3d()[0] for axes in figure.axes]
    assert [len(way) for way in ways] == [1, 6, 11]
    with_target = len(figure.axes[2].collections[0].get_facecolor())
    bare = draw_capture(robot, Geometry(), motion_dataset(7))
    assert with_target > len(bare.axes[2].collections[0].get_facecolor())


def test_every_figure_of_a_capture_is_written(robot, tmp_path):
    whole = xr.merge([scan_dataset(), motion_dataset(7), front_dataset()], combine_attrs="override")
    files = save_capture_figures(robot, GEOMETRY, whole, {"balanced": motion_dataset(7)}, tmp_path, ["png"])
    names = {"grasp_time", "capture", "joints", "base", "tool", "front"}
    names |= {f"balanced_{name}" for name in ("joints", "base", "tool")}
    assert {path.stem for path in files} == names
    assert all(path.stat().st_size > 5000 for path in files)
    (tmp_path / "none").mkdir()
    only = save_capture_figures(robot, GEOMETRY, scan_dataset(1), {}, tmp_path / "none", ["png"])
    assert [path.stem for path in only] == ["grasp_time"]
