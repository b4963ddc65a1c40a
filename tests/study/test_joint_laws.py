"""Joint laws and torque terms from configurations: defaults, refusals with their lines, what is built."""

from pathlib import Path

import numpy as np
import pytest
from config_files import folder, load, write  # noqa: F401 (the fixture acts by being here)

from jffsr.errors import InputError
from jffsr.study.building import build_problem, build_robot
from jffsr.study.config import dump_config, load_config
from jffsr.trajectories.bspline import ClampedBSpline
from jffsr.trajectories.polynomial import Polynomial

CONFIGS = Path(__file__).resolve().parents[2] / "configs" / "min_torque"
PLANAR = """\
kind: planning
robot: hu_2011_planar2
task:
  start_deg: [90, 30]
  goal_deg: [-60, 90]
  duration: 10
"""


def terms_of(problem):
    return [term.name for term in problem.objective.terms]


def test_a_polynomial_comes_with_its_defaults_and_the_overrun_of_positions():
    config = load(PLANAR + "trajectory: {kind: polynomial}\n")
    law = config.trajectory
    assert (law.degree, law.control_points, law.box) == (7, None, 2.0)
    problem = build_problem(config)
    assert isinstance(problem.trajectory, Polynomial)
    assert (problem.trajectory.degree, float(problem.trajectory.box)) == (7, 2.0)
    assert terms_of(problem) == ["attitude_change", "joint_rate", "joint_acceleration", "joint_position"]


def test_a_spline_comes_with_its_defaults_and_keeps_the_limits_by_its_box():
    config = load(PLANAR + "trajectory: {kind: bspline, control_points: 9}\nlimits: {position: 3}\n")
    assert (config.trajectory.degree, config.trajectory.box) == (4, 2.0)
    problem = build_problem(config)
    assert isinstance(problem.trajectory, ClampedBSpline)
    assert problem.trajectory.inner.shape == (3, 2)
    assert "joint_position" not in terms_of(problem)
    assert np.max(problem.bounds()[1]) == 3


def test_the_duration_may_be_free_in_every_law():
    for kind in ("polynomial", "bspline"):
        text = PLANAR.replace("10\n", "{min: 5, max: 20}\n") + f"trajectory: {{kind: {kind}}}\n"
        low, high = build_problem(load(text)).bounds()
        assert (low[-1], high[-1]) == (5, 20)


def test_torque_terms_come_in_their_order_with_the_limits():
    config = load(
        PLANAR
        + "limits: {torque: [5, 3]}\n"
        + "trajectory: {kind: polynomial, degree: 6}\n"
        + "objective:\n  attitude_change: {enabled: false}\n  joint_rate: {enabled: false}\n"
        + "  joint_acceleration: {enabled: false}\n  joint_position: {enabled: false}\n"
        + "  torque_integral: {enabled: true, scale: 2}\n  torque_energy: {enabled: true}\n"
        + "  mechanical_work: {enabled: true}\n  peak_torque: {enabled: true}\n  attitude_penalty: {enabled: true}\n"
    )
    np.testing.assert_array_equal(build_robot(config).limits.torque, [5, 3])
    problem = build_problem(config)
    expected = [
        "joint_torque",
        "torque_integral",
        "torque_energy",
        "mechanical_work",
        "peak_torque",
        "attitude_penalty",
    ]
    assert terms_of(problem) == expected
    assert list(config.enabled_terms) == expected
    assert [float(term.scale) for term in problem.objective.terms] == [0.01, 2, 1, 1, 1, 1e-6]
    np.testing.assert_array_equal(problem.objective.terms[0].limit, [5, 3])
    np.testing.assert_array_equal(problem.objective.terms[-1].goal, [1, 0, 0, 0])
    assert load(dump_config(config)) == config


def test_without_an_effort_or_a_limit_torques_are_not_computed():
    assert not build_problem(load(PLANAR + "trajectory: {kind: polynomial}\n")).objective.needs_torque
    limited = load(PLANAR + "trajectory: {kind: polynomial}\nlimits: {torque: 4}\n")
    assert "joint_torque" in limited.enabled_terms


def test_torque_limits_may_be_a_constraint():
    text = PLANAR + "trajectory: {kind: polynomial}\nconstraints: {torque_limit: {tolerance: 0.01}}\n"
    problem = build_problem(
        load(text + "limits: {torque: [5, 3]}\nobjective: {joint_torque: {enabled: no}}\n")
    )
    (limit,) = problem.constraints
    np.testing.assert_array_equal(limit.limit, [5, 3])
    assert (limit.name, float(limit.tolerance)) == ("torque_limit", 0.01)
    assert problem.needs_torque
    with pytest.raises(
        InputError, match=r"x.yaml:8: constraints.torque_limit: given, but robot 'hu_2011_planar2' has"
    ):
        build_problem(load(text))


REFUSED = {
    "trajectory: {kind: sine_polynomial, degree: 7}\n": "x.yaml:7: trajectory.degree: found 7, the law "
    "'sine_polynomial' has no such number, leave it out",
    "trajectory: {kind: polynomial, control_points: 8}\n": "x.yaml:7: trajectory.control_points: found 8, the law "
    "'polynomial' has no such number, leave it out",
    "trajectory: {kind: polynomial, degree: 5}\n": "x.yaml:7: trajectory.degree: found 5, a polynomial with free "
    "numbers has a degree of at least 6",
    "trajectory: {kind: bspline, degree: 9}\n": "x.yaml:7: trajectory.control_points: found 8, more than the "
    "degree (9) are expected",
    "trajectory: {kind: b_spline}\n": "x.yaml:7: trajectory.kind: found 'b_spline', 'sine_polynomial', "
    "'polynomial' or 'bspline' is expected; did you mean 'bspline'?",
    "limits: {torque: 0}\n": "x.yaml:7: limits.torque: found 0, a number > 0, a list "
    "with one per joint or {joint: number, ...} is expected",
    "objective: {torque_integral: {enable: true}}\n": "x.yaml:7: objective.torque_integral.enable: unknown key; "
    "did you mean 'enabled'?",
}


@pytest.mark.parametrize("added", REFUSED)
def test_refusals(added):
    with pytest.raises(InputError) as caught:
        load(PLANAR + added)
    assert str(caught.value) == REFUSED[added]


def test_what_only_the_robot_can_refuse():
    with pytest.raises(
        InputError, match=r"x.yaml:7: limits.torque: found a list of 3, the robot has 2 joints"
    ):
        build_problem(load(PLANAR + "limits: {torque: [1, 2, 3]}\n"))
    with pytest.raises(InputError, match=r"which the sine-polynomial law needs"):
        build_problem(load(PLANAR))
    outside = PLANAR + "limits: {position_deg: 80}\ntrajectory: {kind: polynomial}\n"
    with pytest.raises(
        InputError, match=r"joint1: 90 deg lies outside its range .* a value inside is expected"
    ):
        build_problem(load(outside))


@pytest.mark.parametrize("path", sorted(CONFIGS.glob("*.yaml")), ids=lambda path: path.stem)
def test_the_configurations_of_minimum_torque_are_built(path):
    problem = build_problem(load_config(path))
    assert problem.needs_torque
    assert problem.trajectory.free_bounds()[0].size > 0
