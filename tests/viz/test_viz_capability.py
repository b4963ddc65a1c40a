"""Drawings of capability maps and grasp times: what is drawn is what was given."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import jffsr
from jffsr.capture.grasp_time import GraspTime, GraspTimeCode
from jffsr.capture.grasp_time_curves import GraspCandidate, GraspScan
from jffsr.viz.capability import draw_capability_slice, draw_capability_space, save_map_figures
from jffsr.viz.grasp_time import draw_grasp_time

CELLS = 9


@pytest.fixture(scope="module")
def capability(robots):
    """A made-up map: the share falls with the distance from (0.7, 0, -1.5) m."""
    axis = np.linspace(-1.6, 1.6, CELLS)
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    share = np.clip(1 - np.linalg.norm(grid, axis=-1) / 1.5, 0, 1)
    return jffsr.CapabilityMap(
        np.array([0.7, 0.0, -1.5]) - 1.6, np.asarray(axis[1] - axis[0]), share, share[..., None], np.eye(3)[:1],
        "servicer_7dof", "tool", 1, True,
    )  # fmt: skip


def test_a_slice_has_the_plane_its_units_and_the_arm(capability, robots):
    figure = draw_capability_slice(capability, "y", 0.0, robots["servicer_7dof"])
    axes, bar = figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [m]", "z [m]")
    assert "y = 0 m" in axes.get_title()
    assert "[-]" in bar.get_ylabel()
    tool = axes.lines[-1].get_xydata()[0]
    # The file's zero pose: column, stub and upper arm down along -z, forearm, hand and tool ahead along x.
    ahead = 0.6780995775 + 0.2 + 0.8 + 0.12 + 0.18
    np.testing.assert_allclose(tool, [ahead, -0.75 - 0.3441809549 - 0.2 - 0.8], atol=1e-12)
    ends = np.concatenate([line.get_xydata() for line in axes.lines])
    assert any(np.allclose(end, [0.6780995775, -0.75], atol=1e-6) for end in ends)
    contours = np.concatenate(
        [path.vertices for path in axes.collections[0].get_paths() if len(path.vertices)]
    )
    distance = np.linalg.norm(contours - [0.7, -1.5], axis=1)
    # The lowest contour is the made-up share's circle of 2 %, but for the cells' size.
    np.testing.assert_allclose(distance.max(), 1.5 * 0.98, atol=0.2)
    between = draw_capability_slice(capability, "z", -1.3)
    assert between.axes[0].get_ylabel() == "y [m]"


def test_the_view_in_space_shows_the_far_half(capability, robots):
    figure = draw_capability_space(capability, robots["servicer_7dof"], least=0.2)
    axes = figure.axes[0]
    offsets = np.stack(axes.collections[0]._offsets3d, axis=1)
    inside = np.asarray(capability.share) >= 0.2
    assert 0.3 * inside.sum() < len(offsets) < 0.7 * inside.sum()
    values = 1 - np.linalg.norm(offsets - [0.7, 0.0, -1.5], axis=1) / 1.5
    np.testing.assert_allclose(axes.collections[0].get_array(), values, atol=1e-12)


def test_wrong_planes_are_refused(capability):
    with pytest.raises(jffsr.InputError, match="allowed are x, y, z"):
        draw_capability_slice(capability, "w")
    with pytest.raises(jffsr.InputError, match="does not cross the map"):
        draw_capability_slice(capability, "x", 7.0)


def test_figures_of_a_layer_are_one(capability, robots, tmp_path):
    flat = replace(
        capability, share=capability.share[:, :, 4:5], direction_share=capability.direction_share[:, :, 4:5]
    )
    paths = save_map_figures(flat, robots["ye_2019_planar3"], tmp_path / "flat")
    assert [path.name for path in paths] == ["flat_z_slice.png"]


def scan(grasp, shift):
    time = np.linspace(0, 20, 201)
    value = 2 + np.cos((time - shift) / 3)
    facing = np.sin(time / 4)
    feasible = facing > 0
    return GraspScan(
        grasp,
        time,
        value,
        value,
        facing,
        0.5 + 0 * time,
        np.ones(201, bool),
        feasible,
        np.array([[0.1, 12.5]]),
    )


def test_the_criterion_is_drawn_with_window_and_choice():
    candidates = (GraspCandidate("b", 8.4, 1.0, 0.5, False), GraspCandidate("a", 9.4, 1.0, 0.5, False))
    found = GraspTime(
        GraspTimeCode.FOUND, "grasp", candidates[0], candidates, (scan("a", 0.0), scan("b", -1.0))
    )
    figure = draw_grasp_time(found)
    top, middle, bottom = figure.axes
    assert [axes.get_ylabel() for axes in (top, middle, bottom)] == [
        "criterion [m]",
        "approach [deg]",
        "map share [-]",
    ]
    assert bottom.get_xlabel() == "time [s]"
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert sorted(words) == ["a", "b", "chosen, 8.4 s", "local minimum", "no grasp possible"]
    shaded = top.collections[0].get_paths()[0].vertices[:, 0]
    assert shaded.max() <= 20
    assert shaded.min() >= 0
    marked = [line.get_xydata()[0] for line in top.lines if line.get_marker() == "o"]
    np.testing.assert_allclose(marked, [[8.4, 1.0], [9.4, 1.0]])
    none = replace(found, candidate=None, candidates=(), code=GraspTimeCode.NEVER_NEAR)
    assert len(draw_grasp_time(none).axes) == 3
