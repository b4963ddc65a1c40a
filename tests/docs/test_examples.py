"""The example scripts: what they find is what mechanics says, with small settings; each is shown on a page."""

from __future__ import annotations

import importlib.util
import re
import sys

import numpy as np
import pytest
from documentation import DOCS, NAMES, ROOT

import jffsr
from jffsr.optimizers.registry import GENERATIONAL, OPTIMIZERS

EXAMPLES = sorted((DOCS / "examples").glob("*.py"))


def example(name: str):
    """An example as a module."""
    spec = importlib.util.spec_from_file_location(name, DOCS / "examples" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    # A dataclass, and an optimizer's name, look their module up.
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # The suite has used JAX before, so that its devices are chosen.
    monkeypatch.setattr("jffsr.parallel.cores.use_all_cores", lambda: 1)
    return tmp_path


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_shown_on_a_page_and_short(path):
    shown = f"--8<--\ndocs/examples/{path.name}\n--8<--"
    pages = [name for name in NAMES if shown in (ROOT / name).read_text(encoding="utf-8")]
    assert pages
    # For who reads the page where nothing is included.
    assert all(
        re.search(rf"\]\((\.\./)?examples/{path.name}\)", (ROOT / name).read_text("utf-8")) for name in pages
    )
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 55


def test_own_optimizer_finds_the_minimum(monkeypatch):
    # What the example adds to the tables is taken out again.
    for optimizers in (GENERATIONAL, OPTIMIZERS):
        monkeypatch.setitem(optimizers, "shrinking", "")
    found = example("own_optimizer").main(small=True)
    # Rosenbrock's function is zero at (1, 1, 1, 1) and 409 or more at a corner of the box; the median of the first
    # generation is above 1000.
    assert found["shrinking"].best_value < 3
    assert found["shrinking"].evaluations == 2_000
    best = np.asarray(found["shrinking"].best_position)
    assert np.all(np.abs(best) <= 2)
    value = np.sum(100 * (best[1:] - best[:-1] ** 2) ** 2 + (1 - best[:-1]) ** 2)
    np.testing.assert_allclose(value, found["shrinking"].best_value, rtol=1e-10)


@pytest.mark.docs
def test_design_gradient_is_the_difference():
    module = example("design_gradient")
    turn, slope = module.main()
    step = 1e-4
    for which in range(2):
        change = step * np.eye(2)[which]
        difference = float(module.base_turn(1 + change) - module.base_turn(1 - change)) / (2 * step)
        np.testing.assert_allclose(slope[which], difference, rtol=1e-6)
    # The quintic's closed form by an adaptive method, in the data of the errata: 19.966 deg from -40 deg.
    np.testing.assert_allclose(np.rad2deg(turn), 59.966184, atol=1e-5)


@pytest.mark.docs
def test_first_plan_meets_its_index(elsewhere):
    plan = example("first_plan").main(small=True)
    assert plan.result.success
    assert plan.cost <= 1
    table = np.loadtxt(elsewhere / "first_plan.csv", delimiter=",", skiprows=1)
    # The base ends as it was turned, the joints at their goal.
    np.testing.assert_allclose(table[-1, 4:8], [1, 0, 0, 0], atol=1e-3)
    np.testing.assert_allclose(table[-1, 8:14], np.deg2rad([120, -30, -95, 40, 170, 60]), atol=1e-9)


@pytest.mark.docs
def test_own_objective_shortens_the_way():
    without, with_term = example("own_objective").main(small=True)
    ways = [
        np.max(np.sum(np.abs(np.diff(plan.motion.joint_position, axis=0)), axis=0))
        for plan in (without, with_term)
    ]
    assert ways[1] < ways[0]
    assert "travel" in with_term.terms
    np.testing.assert_allclose(float(with_term.terms["travel"].value), ways[1], rtol=1e-3)


@pytest.mark.docs
def test_track_a_circle_is_brought_back():
    tracked = example("track_a_circle").main(small=True)
    robot = jffsr.load_robot("servicer_7dof")
    off = {}
    for label, found in tracked.items():
        motion = found.motion
        last = jffsr.State(motion.base_position[-1], motion.base_quaternion[-1], motion.joint_position[-1])
        first = jffsr.State(motion.base_position[0], motion.base_quaternion[0], motion.joint_position[0])
        ends = [jffsr.end_effector_pose(robot, jffsr.kinematics(robot, state))[0] for state in (first, last)]
        off[label] = np.linalg.norm(ends[1] - ends[0])
    # A full circle ends where it began; the held rates alone miss that.
    assert off["fed back"] < 0.5 * off["as planned"]
    assert off["fed back"] < 2e-3


@pytest.mark.docs
def test_capture_meets_the_handle():
    plan = example("capture").main(small=True)
    assert plan.result.success
    assert 15 <= plan.duration <= 40
    assert np.max(np.abs(plan.error)) < 1e-4
    assert plan.cost <= plan.before


@pytest.mark.docs
def test_sweep_has_every_point():
    costs = example("sweep_in_python").main(small=True)
    assert costs.shape == (3, 2)
    assert np.all(np.isfinite(costs))
    # More time is easier.
    assert np.all(np.diff(costs.min(axis=1)) < 0)
