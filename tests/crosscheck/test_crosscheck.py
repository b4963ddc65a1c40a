"""Short motions against MuJoCo and MJX."""

import json
import math
import subprocess
import sys

import jax
import numpy as np
import pytest

import jffsr
from jffsr.crosscheck.compare import attitude_difference, crosscheck
from jffsr.crosscheck.drive import check_x64, make_drive
from jffsr.crosscheck.mujoco_model import branch_order
from jffsr.crosscheck.mujoco_run import run_mujoco
from jffsr.crosscheck.report import Comparison, CrosscheckReport, Tolerances
from jffsr.errors import InputError
from jffsr.robots.builder import build_robot
from jffsr.robots.yaml_schema import RobotModel

MOMENTUM = np.array([1.0, -2.0, 0.5, 0.8, -0.6, 1.1])


@jax.jit
def rollout(robot, trajectory, state, momentum):
    return jffsr.rollout(robot, trajectory, state, num_steps=150, momentum=momentum)


def test_mujoco_agrees_and_converges(tree, tree_trajectory, tumbled):
    report = crosscheck(tree, tree_trajectory, tumbled, steps=(4e-3, 2e-3, 1e-3), engines=["mujoco"])
    assert report.passed, report.sentence
    assert report.shrinks("mujoco")
    attitude = [entry.attitude for entry in report.comparisons]
    assert attitude[1] < attitude[0] / 3
    assert attitude[2] < attitude[1] / 3
    last = report.comparisons[-1]
    assert last.attitude < 1e-8
    assert last.position < 1e-8
    assert last.tracking < 1e-6
    assert last.momentum_linear < 1e-9
    assert last.momentum_angular < 1e-9
    assert last.momentum_angular_relative < 1e-9


def check_mjx(report):
    """MJX agrees with the motion as MuJoCo does, and both converge."""
    assert report.passed, report.sentence
    assert report.shrinks("mjx")
    assert report.shrinks("mujoco")
    mjx, mujoco = report.of_engine("mjx"), report.of_engine("mujoco")
    assert [entry.step for entry in mjx] == pytest.approx([1e-2, 5e-3])
    for theirs, other in zip(mjx, mujoco, strict=True):
        assert theirs.attitude < 1e-5
        assert theirs.position < 1e-5
        # The driver is the same and so is the integrator's order.
        assert theirs.tracking == pytest.approx(other.tracking, rel=1e-2)
        assert theirs.momentum_linear_relative < 1e-5
        assert theirs.momentum_angular_relative < 1e-5
    assert mjx[0].compile_seconds > 0
    assert mjx[1].compile_seconds == 0


@pytest.mark.slow
def test_mjx_agrees_with_mujoco(tumbled):
    """200 and 400 steps of MJX, compiled once, with momentum in all six components."""
    robot = jffsr.load_robot("hu_2011_planar2")
    trajectory = jffsr.SinePolynomial.between([1.0, 0.5], [-0.4, 1.4], [-2.0] * 2, [2.0] * 2, 2.0)
    check_mjx(crosscheck(robot, trajectory, tumbled, momentum=10 * MOMENTUM, steps=(1e-2, 5e-3)))


@pytest.mark.slow
def test_mjx_agrees_with_mujoco_on_a_tree(tree, tree_trajectory, tumbled):
    """The same with branches and a prismatic joint, which takes long to compile."""
    check_mjx(crosscheck(tree, tree_trajectory, tumbled, momentum=MOMENTUM, steps=(1e-2, 5e-3)))


def test_joints_that_are_numbered_across_branches(tumbled):
    """Two arms whose joints take turns: MuJoCo numbers one arm to its end before the other."""
    link = {"mass": 4.0, "com": [0.3, 0.0, 0.05], "inertia": {"xx": 0.05, "yy": 0.3, "zz": 0.3}}

    def joint(name, parent, child, position, axis):
        place = {"parent": parent, "child": child, "position": position}
        return {"name": name, "type": "revolute", "axis": axis, **place}

    model = RobotModel.model_validate(
        {
            "name": "turns",
            "base": {"name": "base", "mass": 40.0, "inertia": {"xx": 5.0, "yy": 6.0, "zz": 7.0}},
            "links": [{"name": name, **link} for name in ("left1", "right1", "left2", "right2")],
            "joints": [
                joint("left_shoulder", "base", "left1", [0.5, 0.3, 0.0], [0, 0, 1]),
                joint("right_shoulder", "base", "right1", [-0.5, 0.2, 0.0], [0, 1, 0]),
                joint("left_elbow", "left1", "left2", [0.6, 0.0, 0.1], [0, 1, 0]),
                joint("right_elbow", "right1", "right2", [0.0, 0.1, 0.6], [1, 0, 0]),
            ],
        }
    )
    robot = build_robot(model.describe("turns"))
    assert robot.topology.parents == (0, 0, 1, 2)
    np.testing.assert_array_equal(branch_order(robot.topology), [0, 2, 1, 3])
    start, goal = [0.2, -0.1, 0.5, -0.4], [1.0, 0.6, -0.6, 0.7]
    trajectory = jffsr.SinePolynomial.between(start, goal, [-2.0] * 4, [2.0] * 4, 2.0)
    report = crosscheck(robot, trajectory, tumbled, momentum=MOMENTUM, engines=["mujoco"])
    assert report.passed, report.sentence
    assert report.comparisons[-1].attitude < 1e-6
    drive = make_drive(
        robot, trajectory, tumbled, np.linspace(0, 2, 11), 1e-2, np.array(MOMENTUM, dtype=float)
    )
    motion = run_mujoco(robot, drive)
    np.testing.assert_allclose(motion.joint_position[0], start, rtol=0, atol=1e-12)
    np.testing.assert_allclose(motion.joint_position[-1], goal, rtol=0, atol=1e-4)


def test_wrong_mass_fails(tree, tree_trajectory, tumbled):
    mass = tree.mass.copy()
    mass[3] *= 1.01
    motion = rollout(tree.replace(mass=mass), tree_trajectory, tumbled, np.zeros(6))
    report = crosscheck(tree, tree_trajectory, tumbled, reference=motion, engines=["mujoco"])
    assert not report.passed
    assert report.sentence.startswith("The cross-check failed: in MuJoCo with ")
    assert "base attitude differs by" in report.sentence


def test_given_motion_is_compared_at_its_own_samples(tree, tree_trajectory, tumbled):
    motion = rollout(tree, tree_trajectory, tumbled, MOMENTUM)
    report = crosscheck(tree, tree_trajectory, tumbled, reference=motion, engines="mujoco", steps=[2e-3])
    assert report.passed, report.sentence
    assert report.momentum == pytest.approx(tuple(MOMENTUM))
    # 13.3 ms between samples: seven steps of at most 2 ms.
    assert report.comparisons[0].step == pytest.approx(2.0 / 150 / 7)
    assert report.shrinks("mujoco") is None


def test_joints_that_move_at_once(tree, tumbled):
    """Initial rates are part of the initial state; any callable is a trajectory."""

    def wave(t):
        s, c = np.array([0.3, 0.1, -0.4, 0.2]), jax.numpy
        return s * c.sin(2 * t), 2 * s * c.cos(2 * t), -4 * s * c.sin(2 * t)

    report = crosscheck(tree, wave, tumbled, 1.0, MOMENTUM, engines=["mujoco"])
    assert report.passed, report.sentence
    assert report.comparisons[-1].attitude < 1e-8


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"engines": ["bullet"]}, "engine 'bullet' is not known; allowed are mujoco, mjx"),
        ({"engines": []}, "no engine was named"),
        ({"steps": []}, "no step length"),
        ({"steps": [0.0]}, "a step is 0 s"),
        ({"duration": -1.0}, "duration is -1 s"),
        ({"momentum": [1.0, 2.0]}, "six finite numbers"),
        ({"momentum": [math.nan] * 6}, "six finite numbers"),
    ],
)
def test_bad_input(tree, tree_trajectory, tumbled, changes, message):
    with pytest.raises(InputError, match=message):
        crosscheck(tree, tree_trajectory, tumbled, **changes)


def test_single_precision_is_refused():
    jax.config.update("jax_enable_x64", False)
    try:
        with pytest.raises(InputError, match="needs double precision"):
            check_x64()
    finally:
        jax.config.update("jax_enable_x64", True)


def test_attitude_difference_is_exact_for_small_angles():
    a = np.array([0.5, -0.5, 0.5, 0.5])
    for angle in (0.0, 1e-12, 1e-3, 2.0):
        turn = np.array([math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0])
        b = np.array(
            [
                a[0] * turn[0] - a[2] * turn[2],
                a[1] * turn[0] - a[3] * turn[2],
                a[0] * turn[2] + a[2] * turn[0],
                a[1] * turn[2] + a[3] * turn[0],
            ]
        )
        for other in (b, -b):
            assert attitude_difference(a, other) == pytest.approx(angle, rel=1e-3, abs=1e-15)


def _entry(step, attitude, tracking=1e-12):
    return Comparison("mujoco", step, attitude, attitude, tracking, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def _report(*entries):
    return CrosscheckReport("arm", 1.0, (0.0,) * 6, Tolerances(), entries)


def test_a_difference_that_grows_as_the_step_shrinks_fails():
    assert _report(_entry(2e-3, 2e-5), _entry(1e-3, 1e-5)).passed
    report = _report(_entry(2e-3, 1e-5), _entry(1e-3, 2e-5))
    assert not report.passed
    assert "attitude difference does not shrink with the step" in report.sentence
    # Under a hundredth of the tolerance, the reference's own error decides.
    assert _report(_entry(2e-3, 1e-9), _entry(1e-3, 2e-9)).passed


def test_not_a_number_fails_and_is_null_in_json():
    report = _report(_entry(1e-3, math.nan, math.nan))
    assert not report.passed
    text = json.dumps(report.to_dict(), allow_nan=False)
    assert json.loads(text)["comparisons"][0]["attitude"] is None
    assert json.loads(text)["passed"] is False


def test_table_has_a_row_per_engine_and_step():
    report = _report(_entry(2e-3, 2e-5), _entry(1e-3, 1e-5))
    lines = report.to_text().splitlines()
    assert len(lines) == 5
    assert lines[-1] == report.sentence
    assert len({len(line) for line in lines[:-1]}) == 1


@pytest.mark.slow
def test_only_the_harmless_lines_are_dropped():
    code = (
        "from jffsr.crosscheck.quiet import HARMLESS_LINES, without_harmless_lines, import_mjx\n"
        "with without_harmless_lines():\n"
        "    print('before'); print(HARMLESS_LINES[0]); print('after', end='')\n"
        "print(); import_mjx(); print('end')\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "before\nafter\nend\n"


def test_engines_are_imported_late():
    code = "import sys, jffsr, jffsr.crosscheck.compare; print('mujoco' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
