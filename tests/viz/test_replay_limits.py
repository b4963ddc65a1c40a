"""Bodies of a replay are coloured by the excursion limit and by clearances, in plans and a sweep's best motions."""

from __future__ import annotations

import numpy as np
import pytest
import xarray

from jffsr.study.building import build_problem
from jffsr.study.config import load_config
from jffsr.study.dataset import excursion_limit
from jffsr.viz.replay.of_plan import excursion, planned_extras
from jffsr.viz.replay.of_sweep import _replay


def test_the_worst_axis_counts(robots):
    angles = np.deg2rad([[0.0, 0.0, 0.0], [2.0, -6.0, 1.0]])
    found = excursion(robots["wu_2018_6dof"], angles, np.deg2rad([4.0, 20.0, np.inf]))
    ((body, share),) = found.nearness.items()
    assert body == robots["wu_2018_6dof"].body_names[0]
    np.testing.assert_allclose(share, [0.0, 0.5])
    assert "of each (4, 20 deg)" in found.legend[0]
    assert not excursion(robots["wu_2018_6dof"], angles, np.full(3, np.inf)).legend


def planar_problem(*settings):
    overrides = ["robot=hu_2011_planar2", "task.start_deg=[90,30]", "task.goal_deg=[-60,90]"]
    return build_problem(load_config("composite_wu6", [*overrides, "rollout.num_steps=8", *settings]))


def folding(turned: bool) -> xarray.Dataset:
    """The arm stretched along x folds its second link, a tube of radius 0.05 m and length 1 m, back to the base."""
    elbow = np.deg2rad([90.0, 150.0, 160.0, 165.0])
    return xarray.Dataset(
        {
            "joint_position": (("time", "joint"), np.stack([0 * elbow, elbow], axis=1)),
            "base_position": (("time", "axis"), np.zeros((4, 3))),
            "base_quaternion": (("time", "component"), np.tile([1.0, 0.0, 0.0, 0.0], (4, 1))),
            "attitude_angle": (("time", "axis"), np.full((4, 3), 0.1 if turned else 0.0)),
        },
        coords={"time": np.arange(4.0)},
    )


@pytest.mark.parametrize("turned", [False, True])
def test_bodies_of_a_plan_are_coloured_as_they_come_near_each_other(turned):
    problem = planar_problem("constraints.clearance={margin: 0.1}", "limits.base_excursion_deg=10")
    dataset = folding(turned)
    found = planned_extras(problem, dataset, np.full(3, np.deg2rad(10)))
    # The elbow is 1 m from the base's face, and the tube's rim, or its side, comes nearest.
    elbow = dataset["joint_position"].values[:, 1]
    apart = 1.0 + np.minimum(np.cos(elbow), 0.0) - 0.05 * np.sin(elbow)
    (panel,) = found.panels
    np.testing.assert_allclose(panel.curves["clearance"], apart, atol=1e-9)
    assert panel.bounds == (0.1,)
    near = np.maximum(1.0 - (apart - 0.1) / 0.2, 0.0)
    assert near[-1] > 1.0 > near[1] > near[0] == 0.0
    np.testing.assert_allclose(found.nearness["link2"], near, atol=1e-8)
    share = np.full(4, 0.1 / np.deg2rad(10)) if turned else np.zeros(4)
    np.testing.assert_allclose(found.nearness["base"], np.maximum(near, share), atol=1e-8)
    assert "link1" not in found.nearness
    assert "excursion limit" in found.legend[0]
    assert "red at 0.1 m, the margin between them" in found.legend[1]


@pytest.mark.parametrize(("limit", "told"), [("10", True), ("null", False)])
def test_a_motion_of_a_sweep_has_it_where_its_study_does(limit, told):
    problem = planar_problem(f"limits.base_excursion_deg={limit}", "constraints.clearance={margin: 0.02}")
    allowed, _ = excursion_limit(problem)
    np.testing.assert_allclose(allowed, np.full(3, np.deg2rad(10) if told else np.inf))
    replay = _replay(problem, np.zeros(4), "one", 1)
    assert any("excursion limit of each (10 deg)" in line for line in replay.legend) == told
    assert any("red at 0.02 m" in line for line in replay.legend)
    (panel,) = [panel for panel in replay.panels if panel.title == "nearest two bodies"]
    assert panel.time.shape == panel.curves["clearance"].shape == (9,)
