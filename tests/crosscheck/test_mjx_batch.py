"""Many robots in one vmapped call of MJX: against ours, against MuJoCo, and the loop against MJX's own step."""

import dataclasses
import json
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jffsr
from jffsr.crosscheck.batch_report import BatchReport
from jffsr.crosscheck.compare import attitude_difference
from jffsr.crosscheck.drive import commanded_acceleration, joint_torque, make_drive
from jffsr.crosscheck.mjx_batch import crosscheck_many, differing_numbers
from jffsr.crosscheck.mjx_follow import advance
from jffsr.crosscheck.mujoco_model import to_mjmodel
from jffsr.crosscheck.mujoco_run import run_mujoco
from jffsr.crosscheck.quiet import import_mjx
from jffsr.crosscheck.report import Tolerances
from jffsr.errors import InputError
from jffsr.robots.stacking import unstack_robots

MOMENTUM = 10 * np.array([1.0, -2.0, 0.5, 0.8, -0.6, 1.1])
COUNT, STEPS = 4, 50


@pytest.fixture(scope="module")
def planar():
    return jffsr.load_robot("hu_2011_planar2")


@pytest.fixture(scope="module")
def trajectory():
    return jffsr.SinePolynomial.between([1.0, 0.5], [-0.4, 1.4], [-2.0] * 2, [2.0] * 2, 1.0)


@pytest.fixture(scope="module")
def start(tumbled):
    return dataclasses.replace(tumbled, joint_position=np.zeros(2))


@jax.jit
def rollouts(robots, trajectory, start, momentum):
    """Our motion of each robot, by the path that planning uses."""
    return jax.vmap(
        lambda robot: jffsr.rollout(robot, trajectory, start, num_steps=STEPS, momentum=momentum)
    )(robots)


@pytest.fixture(scope="module")
def robots(planar):
    return jffsr.perturbed(planar, 3, COUNT, mass=0.1, inertia=0.1, length=0.02)


@pytest.fixture(scope="module")
def motions(robots, trajectory, start):
    return rollouts(robots, trajectory, start, MOMENTUM)


@pytest.fixture(scope="module")
def report(robots, trajectory, start, motions):
    return crosscheck_many(robots, trajectory, start, step=2e-3, reference=motions)


def test_every_robot_of_the_batch_agrees(report, motions):
    assert report.passed, report.sentence
    assert report.count == COUNT
    assert report.momentum == pytest.approx(tuple(MOMENTUM))
    assert report.step == pytest.approx(2e-3)
    assert np.all(report.attitude < 1e-6)
    assert np.all(report.position < 1e-7)
    # The robots part by far more than that, so each was its own.
    final = np.asarray(motions.base_quaternion[:, -1])
    for i in range(COUNT):
        for j in range(i):
            assert attitude_difference(final[i], final[j]) > 1e-3


def test_the_batch_is_what_mujoco_makes_of_each_robot(report, robots, trajectory, start, motions):
    """MuJoCo shares the robot's compiled model but neither the batch nor MJX."""
    times = np.asarray(motions.time[0])
    for k, robot in enumerate(unstack_robots(robots)):
        other = run_mujoco(robot, make_drive(robot, trajectory, start, times, 2e-3, MOMENTUM))
        attitude = attitude_difference(np.asarray(motions.base_quaternion[k]), other.base_quaternion).max()
        assert abs(report.attitude[k] - attitude) < 1e-7
        # What the torques miss is each robot's own, and the same in both engines.
        assert report.tracking[k] == pytest.approx(other.tracking_error, rel=1e-2)


def test_a_motion_of_another_robot_fails_and_is_named(robots, trajectory, start, motions):
    """The last robot's motion is given the third's place, in a sequence of robots instead of a stack."""
    mixed = jax.tree.map(lambda x: jnp.asarray(x).at[2].set(x[3]), motions)
    report = crosscheck_many(unstack_robots(robots), trajectory, start, step=2e-3, reference=mixed)
    assert not report.passed
    assert report.kept.tolist() == [True, True, False, True]
    assert report.sentence.startswith("The cross-check failed for 1 of 4 robots in MJX with 2 ms steps")
    assert "base attitude by" in report.sentence
    assert "for robot 2" in report.sentence
    assert report.worst("attitude")[0] == 2


def test_numbers_that_differ_are_found(planar, robots):
    singles = unstack_robots(robots)
    models = [to_mjmodel(robot, 1e-3) for robot in singles]
    numbers = differing_numbers(import_mjx().put_model(models[0], impl="jax"), models)
    assert {"body_mass", "body_inertia", "body_ipos", "body_pos", "body_subtreemass"} <= set(numbers)
    np.testing.assert_array_equal(numbers["body_mass"][:, 1:], robots.mass)
    np.testing.assert_allclose(numbers["body_subtreemass"][:, 1], robots.mass.sum(axis=1), rtol=1e-12)
    same = [to_mjmodel(planar, 1e-3)] * 2
    assert differing_numbers(import_mjx().put_model(same[0], impl="jax"), same) == {}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"step": 0.0}, "a step is 0 s"),
        ({"momentum": [1.0]}, "six finite numbers"),
        ({"duration": math.nan}, "duration is nan s"),
        ({"robots": []}, "no robot was given"),
    ],
)
def test_bad_input(robots, trajectory, start, changes, message):
    with pytest.raises(InputError, match=message):
        crosscheck_many(**({"robots": robots, "trajectory": trajectory, "initial_state": start} | changes))


def test_robots_of_other_structure_are_refused(planar, tree, trajectory, start, robots, motions):
    with pytest.raises(InputError, match=r"robot 1 \('tree_prismatic'\) differs from robot 0"):
        crosscheck_many([planar, tree], trajectory, start)
    with pytest.raises(InputError, match="a stack of robots, with a leading axis"):
        crosscheck_many(planar, trajectory, start)
    first = jax.tree.map(lambda x: x[:2], motions)
    with pytest.raises(InputError, match="a motion of each of the 4 robots"):
        crosscheck_many(robots, trajectory, start, reference=first)


def _report(attitude, position=(1e-9, 2e-9, 3e-9)):
    numbers = np.array(attitude), np.array(position), np.full(3, 1e-9)
    return BatchReport("arm", 1.0, 1e-3, (0.0,) * 6, Tolerances(), *numbers, 10.0, 0.5)


def test_report_for_people_and_json():
    report = _report([1e-6, 3e-6, 2e-6])
    assert report.passed
    assert report.robots_per_second == 6.0
    assert report.worst("attitude") == (1, 3e-6)
    assert "all 3 robots: base attitude within 3e-06 rad, base position within 3e-09 m" in report.sentence
    lines = report.to_text().splitlines()
    assert len({len(line) for line in lines[:4]}) == 1
    assert lines[-1] == report.sentence
    assert "6 robots a second" in lines[-2]
    plain = json.loads(json.dumps(report.to_dict(), allow_nan=False))
    assert plain["worst"]["position"] == {"robot": 2, "value": 3e-9}
    assert plain["attitude"] == [1e-6, 3e-6, 2e-6]


def test_not_a_number_fails():
    report = _report([1e-6, math.nan, 2e-6], (2e-4, 1e-9, 1e-9))
    assert not report.passed
    assert report.kept.tolist() == [False, False, True]
    assert "failed for 2 of 3 robots" in report.sentence
    assert "base attitude by nan rad (0.0001 allowed) for robot 1" in report.sentence
    assert "base position by 0.0002 m (0.0001 allowed) for robot 0" in report.sentence
    plain = json.loads(json.dumps(report.to_dict(), allow_nan=False))
    assert plain["attitude"][1] is None
    assert plain["worst"]["attitude"] == {"robot": 1, "value": None}


@pytest.mark.physics
def test_the_step_is_mjx_own_runge_kutta_step(planar):
    """The rolled stages against mjx.rungekutta4, which unrolls them, from a state with every velocity."""
    mjx = import_mjx()
    step = 2e-2
    model = to_mjmodel(planar, step)
    mjx_model, blank = mjx.put_model(model, impl="jax"), mjx.make_data(model, impl="jax")
    rng = np.random.default_rng(5)
    qpos, qvel = rng.normal(size=9), rng.normal(size=8)
    qpos[3:7] /= np.linalg.norm(qpos[3:7])
    position, rate, mean = qpos[7:] + 1e-4, qvel[6:] - 1e-3, rng.normal(size=2)

    @jax.jit
    def theirs(qpos, qvel):
        data = blank.replace(qpos=qpos, qvel=qvel)
        data = mjx.fwd_velocity(mjx_model, mjx.fwd_position(mjx_model, data))
        wanted = commanded_acceleration(step, mean, position - qpos[7:], rate - qvel[6:])
        torque = joint_torque(jnp, mjx.full_m(mjx_model, data), data.qfrc_bias, wanted)
        data = mjx.rungekutta4(mjx_model, mjx.forward(mjx_model, data.replace(ctrl=torque)))
        return data.qpos, data.qvel

    ours = jax.jit(lambda carry: advance(mjx_model, blank, carry, (position, rate, mean)))
    found, expected = ours((qpos, qvel, 0.0)), theirs(qpos, qvel)
    np.testing.assert_allclose(found[0], expected[0], rtol=0, atol=1e-13)
    np.testing.assert_allclose(found[1], expected[1], rtol=0, atol=1e-12)
    assert found[2] == pytest.approx(1e-4, rel=1e-9)


@pytest.mark.physics
def test_64_perturbed_six_axis_arms_over_a_whole_plan():
    """The motion of `make demo` for 64 arms, 30,000 steps of 1 ms each."""
    robot = jffsr.load_robot("wu_2018_6dof")
    lower, upper = np.full(6, -np.deg2rad(324)), np.full(6, np.deg2rad(324))
    goals = np.deg2rad([[175, -60, -60, 0, 210, 5], [120, -30, -95, 40, 170, 60]])
    coefficients = np.tile([0.3, -0.2], (6, 1)) * np.array([1, -1, 1, -1, 1, -1])[:, None]
    trajectory = jffsr.SinePolynomial.between(*goals, lower, upper, 30.0, coefficients=coefficients)
    start = jffsr.State(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), goals[0])
    robots = jffsr.perturbed(robot, 0, 64)
    motions = jax.jit(jax.vmap(lambda robot: jffsr.rollout(robot, trajectory, start, num_steps=300)))(robots)
    report = crosscheck_many(robots, trajectory, start, reference=motions)
    print(report.to_text())
    assert report.passed, report.sentence
    assert report.count == 64
    assert report.step == pytest.approx(1e-3)
    final = np.asarray(motions.base_quaternion[:, -1])
    assert attitude_difference(final[:1], final[1:]).min() > 1e-4
