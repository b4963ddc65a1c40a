"""The catalogue: every robot loads, says where its numbers come from, and answers to its names."""

from __future__ import annotations

import chex
import numpy as np
import pytest

from jffsr.errors import InputError
from jffsr.robots.loading import describe_robot, list_robots, load_robot


@pytest.mark.parametrize("name", list_robots())
def test_every_robot_loads_and_cites_its_source(name):
    description = describe_robot(name)
    for field in ("description", "source", "license", "notes"):
        assert len(getattr(description, field).strip()) > 10, f"{name} has no {field}"
    robot = load_robot(name)
    n = robot.num_joints
    assert robot.name == name
    assert len(set(robot.joint_names)) == n
    assert robot.end_effector_names
    chex.assert_shape(robot.mass, (n + 1,))
    chex.assert_shape(robot.inertia, (n + 1, 3, 3))
    chex.assert_shape([robot.link_com, robot.joint_position, robot.joint_axis], (n, 3))
    chex.assert_tree_all_finite(robot.replace(limits=None))
    np.testing.assert_allclose(np.linalg.norm(robot.joint_axis, axis=1), 1, rtol=0, atol=1e-15)


@pytest.mark.parametrize("name", list_robots())
def test_every_body_is_well_inside_what_is_physical(name):
    """Rounding, or a change of units, must not be able to carry a body over the edge."""
    for body, inertia in zip(load_robot(name).body_names, load_robot(name).inertia, strict=True):
        low, middle, high = np.linalg.eigvalsh(inertia)
        assert low > 1e-7, body
        assert low + middle > 1.002 * high, body


@pytest.mark.parametrize("name", list_robots())
def test_every_body_has_shapes_of_a_sensible_size(name):
    robot = load_robot(name)
    for body in robot.body_names:
        shapes = robot.geometry.on_body(body)
        assert shapes, body
        assert all(1e-3 < value < 20 for shape in shapes for value in shape.size)
        assert all(max(abs(shape.position)) < 20 for shape in shapes)


@pytest.mark.parametrize("name", list_robots())
def test_aliases_name_the_same_robot(name):
    for alias in describe_robot(name).aliases:
        assert load_robot(alias).name == name


def test_no_name_is_taken_twice():
    names = [alias for name in list_robots() for alias in (name, *describe_robot(name).aliases)]
    assert len(names) == len(set(names))


def test_the_papers_robots_and_the_flown_ones_are_there():
    papers = {"wu_2018_6dof", "hu_2011_planar2", "ye_2019_planar3", "servicer_7dof", "li_2022_7dof"}
    assert papers | {"ets7_6dof", "canadarm2_7dof", "astrobee_2dof", "vispa_6dof"} <= set(list_robots())
    assert list(list_robots()) == sorted(list_robots())


def test_an_unknown_name_is_refused_with_the_nearest():
    with pytest.raises(InputError, match=r"'wu_6dfo' is not in the catalogue; did you mean 'wu_6dof'\?"):
        load_robot("wu_6dfo")


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"gone\.yaml: there is no such file"):
        load_robot(tmp_path / "gone.yaml")
    (tmp_path / "tender.urdf").write_text("<robot/>")
    with pytest.raises(
        InputError, match=r"tendr\.urdf: there is no such file; did you mean 'tender\.urdf'\?"
    ):
        load_robot(tmp_path / "tendr.urdf")


def test_a_file_gives_what_the_builder_makes_of_it(robots):
    """two_arms has every feature at once: branches, sliding joints, a lumped mast, joints out of order."""
    robot = robots["two_arms"]
    assert robot.joint_names == ("left_shoulder", "left_extend", "left_wrist", "right_extend", "right_wrist")
    assert robot.topology.parents == (0, 1, 2, 0, 4)
    assert robot.end_effector_names == ("left", "right")
    np.testing.assert_array_equal(robot.topology.is_revolute, [True, False, True, False, True])
    np.testing.assert_allclose(robot.mass[0], 32.0)
