"""Derivatives of a plan by masses and inertias: against differences of other robots' motions, and a law."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from wu6_problems import limited, wu6_problem

from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.planning.sensitivity import MOMENTS, Inertials, PlanEnd, Sensitivity, sensitivity
from jffsr.robots.state import State
from jffsr.rollouts.reference import reference_rollout
from jffsr.study.sensitivity_summary import sensitivity_lines, sensitivity_summary

FREE = 0.4 * np.random.default_rng(11).standard_normal(12)
MOMENTUM = np.array([2.0, -1.0, 0.5, 0.3, -0.2, 0.4])
# Central differences at these multiples of the step, with these weights, leave an error of the fourth order.
REACH, WEIGHT = np.array([1.0, -1.0, 2.0, -2.0]), np.array([2 / 3, -2 / 3, -1 / 12, 1 / 12])
STEP = 4e-3


@pytest.fixture(scope="module")
def problem(robots):
    return wu6_problem(limited(robots["wu_2018_6dof"]), num_steps=100, momentum=MOMENTUM)


@pytest.fixture(scope="module")
def found(problem):
    return sensitivity(problem, FREE)


@pytest.fixture(scope="module")
def differences(problem):
    """The same derivatives from the reference path, robot by robot: (entry, (b + 6 b, 3)) by name."""
    robot = problem.robot
    bodies = len(robot.body_names)
    steps, masses, inertias = [], [], []
    for quantity in range(7):
        for body in range(bodies):
            trace = np.trace(robot.inertia[body])
            step = STEP * (robot.mass[body] if quantity == 0 else trace)
            steps.append(step)
            for reach in REACH:
                mass, inertia = robot.mass.copy(), robot.inertia.copy()
                if quantity == 0:
                    mass[body] += reach * step
                else:
                    row, column = ("xyz".index(letter) for letter in MOMENTS[quantity - 1])
                    inertia[body, row, column] += reach * step
                    if row != column:
                        inertia[body, column, row] += reach * step
                masses.append(mass)
                inertias.append(inertia)
    trajectory = problem.trajectory.with_free(FREE)

    def end(mass, inertia):
        other = robot.replace(mass=mass, inertia=inertia)
        motion = reference_rollout(
            other, trajectory, problem.initial_state, num_steps=200, momentum=problem.momentum
        )
        state = State(motion.base_position[-1], motion.base_quaternion[-1], motion.joint_position[-1])
        return *vars(state).values(), end_effector_pose(other, kinematics(other, state))[0]

    run = jax.jit(lambda m, i: jax.lax.map(lambda x: end(*x), (m, i), batch_size=28))
    ends = run(jnp.array([robot.mass, *masses]), jnp.array([robot.inertia, *inertias]))
    position, quaternion, tool = (np.asarray(ends[k]) for k in (0, 1, -1))
    # Vector part of the relative quaternion, twice: the rotation vector to the third order.
    w, x, y, z = quaternion[0]
    left = np.array([[-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]])
    half = quaternion[1:] @ left.T
    turn = 2 * np.arcsin(np.linalg.norm(half, axis=1))[:, None] * half
    turn /= np.maximum(np.linalg.norm(half, axis=1), 1e-300)[:, None]

    def differenced(rows):
        by_step = np.einsum("sri,r->si", rows.reshape(-1, 4, 3), WEIGHT)
        return by_step / np.array(steps)[:, None]

    return {
        "attitude": differenced(turn),
        "position": differenced(position[1:]),
        "tool": differenced(tool[1:]),
    }


@pytest.mark.parametrize("name", ["attitude", "position", "tool"])
def test_against_differences_of_other_robots(found, differences, name):
    entry, expected = getattr(found.derivative, name), differences[name]
    bodies = len(found.bodies)
    np.testing.assert_allclose(
        entry.mass.T, expected[:bodies], rtol=0, atol=1e-6 * np.abs(expected[:bodies]).max()
    )
    inertia = expected[bodies:].reshape(6, bodies, 3)
    np.testing.assert_allclose(
        np.moveaxis(entry.inertia, 0, -1), inertia.swapaxes(0, 1), rtol=0, atol=1e-6 * np.abs(inertia).max()
    )
    assert np.abs(expected).max() > 1e-6


def test_index_against_differences(problem, found):
    """The smooth index of heavier and lighter last links."""
    robot = problem.robot

    @jax.jit
    def index(problem):
        return problem.smooth_and_value(FREE)[0]

    def with_mass(change):
        mass = robot.mass.copy()
        mass[6] *= 1 + change
        return float(index(replace(problem, robot=robot.replace(mass=mass))))

    values = np.array([with_mass(reach * 1e-3) for reach in REACH])
    expected = WEIGHT @ values / (1e-3 * robot.mass[6])
    assert found.derivative.index.mass[6] == pytest.approx(expected, rel=1e-6)


def test_same_factor_everywhere_changes_no_motion(problem):
    """At zero momentum a common factor of all masses and inertias cancels: its derivative is zero."""
    still = sensitivity(replace(problem, momentum=np.zeros(6)), FREE)
    for entry in vars(still.derivative).values():
        by_mass = entry.mass * still.nominal.mass
        by_inertia = entry.inertia * still.nominal.inertia
        total = by_mass.sum(axis=-1) + by_inertia.sum(axis=(-2, -1))
        assert np.abs(total).max() < 1e-11 * np.abs(by_mass).max()


def test_with_momentum_it_does_change(found):
    entry = found.derivative.attitude
    total = (entry.mass * found.nominal.mass).sum(axis=-1) + (entry.inertia * found.nominal.inertia).sum(
        axis=(-2, -1)
    )
    assert np.abs(total).max() > 1e-3 * np.abs(entry.mass * found.nominal.mass).max()


def by_hand(tool=True) -> Sensitivity:
    """Two bodies with derivatives that are easy to add up."""
    nominal = Inertials(np.array([100.0, 10.0]), np.array([[4.0, 5, 6, 0, 0, 1], [1.0, 1, 1, 0, 0, 0]]))
    zero = Inertials(np.zeros((3, 2)), np.zeros((3, 2, 6)))
    attitude = Inertials(zero.mass.copy(), zero.inertia.copy())
    attitude.mass[:, 1] = [3e-3, 0.0, 4e-3]
    attitude.inertia[2, 0, 2] = 2.0
    attitude.inertia[2, 0, 5] = -3.0
    shift = Inertials(zero.mass.copy(), zero.inertia)
    shift.mass[0] = [1e-3, -0.2]
    index = Inertials(np.array([0.5, -2.0]), np.zeros((2, 6)))
    end = PlanEnd(index, attitude, zero, shift if tool else None)
    return Sensitivity(("base", "link1"), "hand" if tool else None, nominal, end)


def test_effects_of_one_percent_are_ordered_and_told():
    rows = by_hand().per_percent
    assert [(row.quantity, row.body) for row in rows[:2]] == [("mass", "link1"), ("mass", "base")]
    assert rows[0].tool == pytest.approx(0.02)
    assert rows[0].attitude == pytest.approx(5e-4)
    assert rows[0].index == pytest.approx(-0.2)
    assert rows[0].sentence == (
        "1 % of the mass of link1 moves the final tool by 20 mm and the final attitude by 0.029 deg"
    )
    without = by_hand(tool=False).per_percent
    # 0.01 (6 2 - 1 3) rad: the inertia of the base as a whole.
    assert (without[0].quantity, without[0].body) == ("inertia", "base")
    assert without[0].attitude == pytest.approx(0.09)
    assert without[0].sentence == "1 % of the inertia of base moves the final attitude by 5.2 deg"


def test_summary_has_every_derivative_and_the_text_names_the_largest():
    summary = sensitivity_summary(by_hand())
    assert summary["end_effector"] == "hand"
    base, link = summary["bodies"]["base"], summary["bodies"]["link1"]
    assert base["mass_kg"] == 100.0
    assert base["inertia_kg_m2"] == dict(zip(MOMENTS, [4.0, 5.0, 6.0, 0.0, 0.0, 1.0], strict=True))
    assert base["final_attitude_rad_per_kg_m2"]["yz"] == [0.0, 0.0, -3.0]
    assert link["final_attitude_rad_per_kg"] == [3e-3, 0.0, 4e-3]
    assert link["final_tool_m_per_kg"] == [-0.2, 0.0, 0.0]
    assert link["final_position_m_per_kg"] == [0.0, 0.0, 0.0]
    assert link["index_per_kg"] == -2.0
    assert [row["body"] for row in summary["per_percent"][:2]] == ["link1", "base"]
    lines = sensitivity_lines(summary)
    assert len(lines) == 3
    assert lines[0].split() == f"sensitivity {by_hand().per_percent[0].sentence}".split()
    assert "final_tool_m" not in str(sensitivity_summary(by_hand(tool=False)))
    assert sensitivity_lines(None) == []


@pytest.mark.slow
def test_planar_arm_without_a_tool(robots):
    """A planar motion turns about z alone, whatever the masses are."""
    robot = limited(robots["hu_2011_planar2"])
    topology = replace(robot.topology, end_effector_names=(), end_effector_bodies=())
    bare = robot.replace(
        topology=topology, end_effector_position=np.zeros((0, 3)), end_effector_rotation=np.zeros((0, 3, 3))
    )
    problem = wu6_problem(bare, 16, 20.0, start=np.array([1.5, 0.5]), goal=np.array([-1.0, 1.5]))
    planar = sensitivity(problem, np.array([0.3, -0.2, 0.1, 0.4]))
    assert planar.end_effector is None
    assert planar.derivative.tool is None
    turn = planar.derivative.attitude.mass
    assert np.abs(turn[2]).max() > 1e-6
    np.testing.assert_allclose(turn[:2], 0.0, atol=1e-15)
    assert all(row.tool is None for row in planar.per_percent)
