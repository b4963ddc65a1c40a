"""Clearances of a robot and a target over a motion, reports on them, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import jax
import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jffsr.clearance.along_motion import clearances
from jffsr.clearance.model import ClearanceModel
from jffsr.clearance.reports import check_start, nearest_approach
from jffsr.crosscheck.mujoco_model import to_mjspec
from jffsr.dynamics.kinematics import kinematics
from jffsr.errors import InputError
from jffsr.objectives.clearance import Clearance
from jffsr.robots.geometry import Geometry, Shape
from jffsr.robots.state import State

SAMPLES = 9
BUS = Geometry((Shape("bus", "box", "bus", np.zeros(3), np.eye(3), np.array([0.5, 0.4, 0.6])),))


class Poses(NamedTuple):
    position: np.ndarray
    quaternion: np.ndarray


class Samples(NamedTuple):
    time: np.ndarray
    base_position: np.ndarray
    base_quaternion: np.ndarray
    joint_position: np.ndarray


def quaternions(generator: np.random.Generator, spread: float) -> np.ndarray:
    return Rotation.from_rotvec(spread * generator.normal(size=(SAMPLES, 3))).as_quat(scalar_first=True)


@pytest.fixture(scope="module")
def scene(robots):
    """The servicing arm beside a box, moving at random; both held away from touching."""
    generator = np.random.default_rng(8)
    robot = robots["servicer_7dof"]
    joints = generator.uniform(-1.2, 1.2, (SAMPLES, 7))
    time = np.linspace(0.0, 4.0, SAMPLES)
    base = 0.1 * generator.normal(size=(SAMPLES, 3)), quaternions(generator, 0.2)
    target = Poses(
        np.array([1.8, 0.5, -1.2]) + 0.2 * generator.normal(size=(SAMPLES, 3)), quaternions(generator, 1)
    )
    return robot, ClearanceModel.create(robot, BUS), Samples(time, *base, joints), target


def test_never_more_than_mujoco_finds_between_the_shapes(scene):
    robot, model, motion, target = scene
    spec = to_mjspec(robot)
    kinds = {"box": mujoco.mjtGeom.mjGEOM_BOX, "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER}
    for shape in robot.geometry.shapes:
        quaternion = Rotation.from_matrix(shape.rotation).as_quat(scalar_first=True)
        size = np.resize([*shape.size, 0.0], 3)
        spec.body(shape.body).add_geom(type=kinds[shape.kind], size=size, pos=shape.position, quat=quaternion)
    body = spec.worldbody.add_body(name="target")
    body.add_freejoint()
    body.add_geom(type=kinds["box"], size=BUS.shapes[0].size)
    compiled = spec.compile()
    data = mujoco.MjData(compiled)
    theirs = np.zeros((len(model.pair_names), SAMPLES))
    for k in range(SAMPLES):
        data.qpos[:] = np.concatenate([x[k] for x in (*motion[1:], *target)])
        mujoco.mj_kinematics(compiled, data)
        for p, names in enumerate(model.pair_names):
            geoms = [np.flatnonzero(compiled.geom_bodyid == compiled.body(name).id) for name in names]
            theirs[p, k] = min(
                mujoco.mj_geomDistance(compiled, data, i, j, 10.0, None) for i in geoms[0] for j in geoms[1]
            )
    ours = clearances(model, robot, motion, target)
    assert (theirs < 0).sum() > 5
    assert np.all(ours <= theirs + 1e-9)
    # Two cylinders, or the capsule around the gripper: what is lost is a part of a radius.
    lost = (theirs - ours)[theirs > 0]
    assert np.median(lost) < 2e-3
    assert lost.max() < 0.08
    boxes = model.pair_names.index(("base", "target"))
    np.testing.assert_allclose(ours[boxes], theirs[boxes], rtol=0, atol=1e-9)


def test_a_call_with_kinematics_gives_the_same(scene):
    robot, _, motion, _ = scene
    model = ClearanceModel.create(robot)
    kin = jax.jit(kinematics)(
        robot, State(motion.base_position[3], motion.base_quaternion[3], motion.joint_position[3])
    )
    expected = clearances(model, robot, motion)[:, 3]
    np.testing.assert_allclose(model(kin.origin, kin.rotation), expected, rtol=0, atol=1e-12)


def test_neighbours_are_left_out_and_what_is_ignored(robots):
    robot = robots["servicer_7dof"]
    every = ClearanceModel.create(robot).pair_names
    assert len(every) == 21
    assert ("base", "link1") not in every
    assert ("link3", "link4") not in every
    fewer = ClearanceModel.create(robot, BUS, ignore=[("target", "link7"), ("link1", "link3")]).pair_names
    assert set(fewer) - set(every) == {(name, "target") for name in robot.body_names if name != "link7"}
    assert set(every) - set(fewer) == {("link1", "link3")}


def test_every_robot_of_the_catalogue_has_a_model(robots):
    for name, robot in robots.items():
        if robot.geometry.shapes:
            model = ClearanceModel.create(robot)
            parents = {(parent, joint + 1) for joint, parent in enumerate(robot.topology.parents)}
            names = {tuple(robot.body_names[b] for b in pair) for pair in parents}
            assert not names & set(model.pair_names), name


def test_mesh_counts_as_the_box_around_it(scene):
    robot, model, motion, target = scene
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.4, 0.4) for z in (-0.6, 0.6)])
    mesh = Shape("mesh", "mesh", "bus", np.zeros(3), np.eye(3), vertices=corners, faces=np.array([[0, 1, 2]]))
    meshed = ClearanceModel.create(robot, Geometry((mesh,)))
    expected = clearances(model, robot, motion, target)
    np.testing.assert_allclose(clearances(meshed, robot, motion, target), expected, rtol=0, atol=1e-12)


def test_nearest_approach_names_pair_and_time(scene):
    robot, model, motion, target = scene
    distances = clearances(model, robot, motion, target)
    found = nearest_approach(model, robot, motion, target)
    assert found.distance == distances.min()
    assert found.time == motion.time[found.sample]
    assert distances[model.pair_names.index(found.pair), found.sample] == distances.min()
    assert f"overlap by {-found.distance:.4g} m at {found.time:.4g} s" in str(found)


def test_constraint_is_the_smallest_distance_rounded_to_the_safe_side(scene):
    robot, model, motion, target = scene
    constraint = Clearance(model, margin=0.03, target=target, width=1e-3)
    found = 0.1 * np.asarray(constraint.inequality(robot, motion))
    exact = 0.03 - clearances(model, robot, motion, target).min(axis=1)
    assert np.all(found >= exact - 1e-12)
    assert np.all(found <= exact + 1e-3 * np.log(SAMPLES) + 1e-12)
    assert constraint.equality(robot, motion).shape == (0,)


def test_constraint_asks_a_moving_target_for_its_poses(scene):
    robot, model, motion, target = scene
    drift = np.array([0.1, -0.2, 0.05])

    def pose(time):
        return Poses(target.position[0] + drift * time, target.quaternion[0])

    asked = Clearance(model, target=jax.tree_util.Partial(pose), begin=2.0).inequality(robot, motion)
    moved = Poses(
        target.position[0] + drift * (motion.time + 2)[:, None], np.tile(target.quaternion[0], (SAMPLES, 1))
    )
    given = Clearance(model, target=moved).inequality(robot, motion)
    np.testing.assert_allclose(asked, given, rtol=0, atol=1e-9)


def start_of(motion: Samples, k: int) -> State:
    return State(motion.base_position[k], motion.base_quaternion[k], motion.joint_position[k])


def test_start_in_collision_is_refused_with_both_names_and_the_depth(scene):
    robot, model, motion, _ = scene
    start = replace(start_of(motion, 0), base_position=np.zeros(3), base_quaternion=np.array([1.0, 0, 0, 0]))
    start = replace(start, joint_position=np.deg2rad([0, -60, 0, 45, 0, -15, 0]))
    far, near = (Poses(np.array([x, 0.0, 0.0]), np.array([1.0, 0, 0, 0])) for x in (4.0, 1.2))
    check_start(model, robot, start, far)
    # 0.8 m and 0.5 m of half sides, 1.2 m between the centres.
    with pytest.raises(InputError, match=r"start in collision: 'base' and 'target' overlap by 0\.1 m"):
        check_start(model, robot, start, near)
    beside = Poses(np.array([1.31, 0.0, 0.0]), np.array([1.0, 0, 0, 0]))
    check_start(model, robot, start, beside)
    with pytest.raises(
        InputError, match=r"'base' and 'target' are 0\.01 m apart, less than the margin of 0\.02 m"
    ):
        check_start(model, robot, start, beside, margin=0.02)


def test_refusals(scene, robots):
    robot, model, motion, _ = scene
    with pytest.raises(InputError, match=r"ignore: body 'link8' does not exist.*did you mean 'link"):
        ClearanceModel.create(robot, ignore=[("link8", "base")])
    with pytest.raises(InputError, match="arm is 'capsule'; allowed are capsules, exact"):
        ClearanceModel.create(robot, arm="capsule")
    with pytest.raises(
        InputError, match=r"no two bodies .* that can meet; shapes .* are missing on base, link1, "
    ):
        ClearanceModel.create(replace(robot, geometry=Geometry()))
    with pytest.raises(InputError, match="the target has no shape with the role 'collision'"):
        ClearanceModel.create(robot, Geometry((replace(BUS.shapes[0], roles=("visual",)),)))
    with pytest.raises(InputError, match="the model has a target, and no pose of a target was given"):
        clearances(model, robot, motion)
