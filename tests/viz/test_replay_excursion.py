"""The base of a replay is coloured by its share of the excursion limit, in plans and in a sweep's best motions."""

from __future__ import annotations

import numpy as np
import pytest

from jffsr.study.building import build_problem
from jffsr.study.config import load_config
from jffsr.study.dataset import excursion_limit
from jffsr.viz.replay.of_plan import excursion
from jffsr.viz.replay.of_sweep import _replay


def test_the_worst_axis_counts(robots):
    angles = np.deg2rad([[0.0, 0.0, 0.0], [2.0, -6.0, 1.0]])
    found = excursion(robots["wu_2018_6dof"], angles, np.deg2rad([4.0, 20.0, np.inf]))
    ((body, share),) = found.nearness.items()
    assert body == robots["wu_2018_6dof"].body_names[0]
    np.testing.assert_allclose(share, [0.0, 0.5])
    assert "of each (4, 20 deg)" in found.legend[0]
    assert not excursion(robots["wu_2018_6dof"], angles, np.full(3, np.inf)).legend


@pytest.mark.parametrize(("limit", "told"), [("10", True), ("null", False)])
def test_a_motion_of_a_sweep_has_it_where_its_study_does(limit, told):
    overrides = ["robot=hu_2011_planar2", "task.start_deg=[90,30]", "task.goal_deg=[-60,90]"]
    config = load_config(
        "composite_wu6", [*overrides, "rollout.num_steps=8", f"limits.base_excursion_deg={limit}"]
    )
    problem = build_problem(config)
    allowed, _ = excursion_limit(problem)
    np.testing.assert_allclose(allowed, np.full(3, np.deg2rad(10) if told else np.inf))
    replay = _replay(problem, np.zeros(4), "one", 1)
    assert any("excursion limit of each (10 deg)" in line for line in replay.legend) == told
