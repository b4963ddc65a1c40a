"""Random errors in a robot's numbers: every one a body can have, with the mean and deviation asked for."""

import numpy as np
import pytest

import jffsr
from jffsr.errors import InputError
from jffsr.robots.builder import check_link
from jffsr.robots.description import LinkDescription
from jffsr.robots.stacking import count_robots, stack_robots, unstack_robots

COUNT = 1000


@pytest.fixture(scope="module")
def robot(robots):
    return robots["wu_2018_6dof"]


@pytest.fixture(scope="module")
def many(robot):
    return jffsr.perturbed(robot, 0, COUNT)


def test_a_thousand_large_errors_leave_bodies_that_can_be(robot):
    """A third of every second moment, and bodies flat and thin among them: the checks of loading accept all."""
    flat = robot.inertia.copy()
    flat[2] = np.diag([1.0, 2.0, 3.0])
    flat[3] = np.diag([0.001, 1.0, 1.0])
    robots = jffsr.perturbed(robot.replace(inertia=flat), 1, COUNT, mass=0.3, inertia=0.33, length=0.1)
    assert np.all(robots.mass > 0)
    np.testing.assert_allclose(robots.inertia, np.swapaxes(robots.inertia, -1, -2), rtol=0, atol=0)
    moments = np.linalg.eigvalsh(robots.inertia)
    assert np.all(moments[..., 0] > 0)
    slack = moments[..., 0] + moments[..., 1] - moments[..., 2]
    assert np.all(slack > -1e-12 * moments[..., 2])
    # Flat stays flat: the density has no extent across, however it is stretched.
    assert np.all(slack[:, 2] < 1e-12 * moments[:, 2, 2])
    for k in range(0, COUNT, 50):
        for body, name in enumerate(robot.body_names):
            link = LinkDescription(name, robots.mass[k, body], np.zeros(3), robots.inertia[k, body])
            check_link(f"draw {k}", link)


def test_mean_and_deviation_are_those_asked_for(robot, many):
    factor = many.mass / robot.mass
    assert factor.mean() == pytest.approx(1.0, abs=3e-3)
    assert factor.std() == pytest.approx(0.05, rel=0.05)
    np.testing.assert_allclose(factor.std(axis=0), 0.05, rtol=0.15)
    apart = np.corrcoef(factor, rowvar=False) - np.eye(factor.shape[1])
    assert np.abs(apart).max() < 0.15

    shape = many.inertia / factor[..., None, None]
    scale = np.trace(robot.inertia, axis1=-2, axis2=-1)[:, None, None]
    np.testing.assert_allclose(shape.mean(axis=0) / scale, robot.inertia / scale, atol=3e-3)
    direction = np.array([0.6, -0.64, 0.48])
    for axis in (*np.eye(3), direction):
        second = np.trace(shape, axis1=-2, axis2=-1) / 2 - np.einsum("i,kbij,j->kb", axis, shape, axis)
        np.testing.assert_allclose(second.std(axis=0) / second.mean(axis=0), 0.05, rtol=0.15)

    length = many.joint_position[:, 1:] / np.where(
        robot.joint_position[1:] == 0, np.nan, robot.joint_position[1:]
    )
    assert np.nanmean(length) == pytest.approx(1.0, abs=1e-3)
    assert np.nanstd(length) == pytest.approx(0.01, rel=0.1)


def test_points_of_one_body_share_their_factor(many, robot):
    """Link 1's centre of mass and the joint that it carries move together; another body's do not."""

    def factors(points, nominal):
        return np.linalg.norm(points, axis=-1) / np.linalg.norm(nominal)

    parents = robot.topology.parents
    moved = [i for i, p in enumerate(parents) if p > 0 and np.linalg.norm(robot.joint_position[i]) > 0]
    i = next(i for i in moved if np.linalg.norm(robot.link_com[parents[i] - 1]) > 0)
    own = factors(many.joint_position[:, i], robot.joint_position[i])
    com = factors(many.link_com[:, parents[i] - 1], robot.link_com[parents[i] - 1])
    np.testing.assert_allclose(own, com, rtol=1e-12)
    others = [j for j in moved if parents[j] != parents[i]]
    other = factors(many.joint_position[:, others[0]], robot.joint_position[others[0]])
    assert np.abs(np.corrcoef(own, other)[0, 1]) < 0.15


def test_nothing_asked_for_changes_nothing(robot):
    same = jffsr.perturbed(robot, 0, 3, mass=0.0, inertia=0.0, length=0.0)
    for one in unstack_robots(same):
        np.testing.assert_array_equal(one.mass, robot.mass)
        np.testing.assert_array_equal(one.link_com, robot.link_com)
        np.testing.assert_allclose(one.inertia, robot.inertia, rtol=1e-13, atol=1e-15)


def test_seed_decides(robot, many):
    again = jffsr.perturbed(robot, 0, COUNT)
    np.testing.assert_array_equal(again.mass, many.mass)
    np.testing.assert_array_equal(again.inertia, many.inertia)
    assert not np.array_equal(jffsr.perturbed(robot, 1, COUNT).mass, many.mass)
    assert again.topology == robot.topology


def test_tree_with_two_tools(robots):
    """Tools follow the factor of the body that carries them, also where it is the base."""
    robot = robots["two_arms"]
    many = jffsr.perturbed(robot, 2, 5)
    assert count_robots(many) == 5
    assert many.end_effector_position.shape == (5, *robot.end_effector_position.shape)
    np.testing.assert_array_equal(many.limits.velocity[3], robot.limits.velocity)


def test_stack_and_unstack(robot, many):
    singles = unstack_robots(many)[:4]
    stacked = stack_robots(singles)
    np.testing.assert_array_equal(stacked.inertia, many.inertia[:4])
    np.testing.assert_array_equal(singles[2].joint_position, many.joint_position[2])
    with pytest.raises(InputError, match="different leading axes"):
        unstack_robots(many.replace(mass=many.mass[:5]))
    with pytest.raises(InputError, match="a stack of robots"):
        unstack_robots(robot)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"count": 0}, "count is 0; a positive whole number"),
        ({"count": 2.5}, "count is 2.5"),
        ({"mass": -0.1}, r"mass is -0.1; a relative standard deviation in \[0, 0.5\]"),
        ({"inertia": 0.7}, "inertia is 0.7"),
        ({"length": float("nan")}, "length is nan"),
    ],
)
def test_bad_input(robot, changes, message):
    with pytest.raises(InputError, match=message):
        jffsr.perturbed(**({"robot": robot, "seed": 0, "count": 2} | changes))
