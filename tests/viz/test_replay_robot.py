"""A robot's replay: its bodies are where the kinematics says, its arrows what its parts' motion amounts to."""

from __future__ import annotations

from dataclasses import replace

import chex
import jax
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from viz_runs import run_dataset

import jffsr
from jffsr.dynamics.kinematics import kinematics
from jffsr.robots.robot import Limits
from jffsr.viz.replay.momenta import legend_of, with_one_scale
from jffsr.viz.replay.of_robot import Extras, joint_nearness, robot_replay

STEP = 1e-5


def moving_dataset(robot):
    """A run in which base and joints move as their rates say, to first order over STEP."""
    data = run_dataset(joints=list(robot.joint_names))
    spin = np.array([0.02, -0.03, 0.05])
    count = data.sizes["time"]
    data["base_twist"] = (("time", "twist"), np.tile([0.1, 0.0, -0.2, *spin], (count, 1)))
    return data


@pytest.fixture(scope="module")
def shown(robots):
    robot = robots["two_arms"].replace(
        limits=Limits.symmetric(
            position=1.0, velocity=0.5, acceleration=1.0, num_joints=robots["two_arms"].num_joints
        )
    )
    data = moving_dataset(robot)
    return (
        robot,
        data,
        robot_replay("two arms", robot, data, Extras(nearness={robot.body_names[0]: np.linspace(0, 1, 41)})),
    )


@jax.jit
def bodies(robot, position, quaternion, joints):
    return kinematics(robot, jffsr.State(position, quaternion, joints))


def at(robot, data, sample, later=0.0):
    """Kinematics at a sample, or `later`, s, on at its rates."""
    place = data["base_position"].values[sample] + later * data["base_twist"].values[sample, :3]
    turn = Rotation.from_quat(data["base_quaternion"].values[sample], scalar_first=True)
    turn = Rotation.from_rotvec(later * data["base_twist"].values[sample, 3:]) * turn
    joints = data["joint_position"].values[sample] + later * data["joint_velocity"].values[sample]
    return jax.device_get(bodies(robot, place, turn.as_quat(scalar_first=True), joints))


def test_bodies_move_as_the_kinematics_says(shown):
    robot, data, replay = shown
    assert replay.frames == data.sizes["time"]
    sample = 23
    kin = at(robot, data, sample)
    frames = {name: (kin.origin[b], kin.rotation[b]) for b, name in enumerate(robot.body_names)}
    for solid in replay.solids:
        matches = [
            np.allclose(solid.position[sample], place, atol=1e-12)
            and np.allclose(
                Rotation.from_quat(solid.quaternion[sample], scalar_first=True).as_matrix(), turn, atol=1e-12
            )
            for place, turn in frames.values()
        ]
        assert any(matches), solid.name
    # Housings are on their joints, at this sample as at any other.
    for joint, name in enumerate(robot.joint_names):
        (solid,) = [s for s in replay.solids if s.name == f"{name} joint"]
        turn = Rotation.from_quat(solid.quaternion[sample], scalar_first=True).as_matrix()
        middle = solid.vertices.min(axis=0) + 0.5 * np.ptp(solid.vertices, axis=0)
        np.testing.assert_allclose(turn @ middle + solid.position[sample], kin.anchor[joint], atol=2e-2)


def test_ways_follow_base_and_tools(shown):
    robot, data, replay = shown
    ways = {way.name: way.points for way in replay.ways}
    np.testing.assert_allclose(ways["base's way"], data["base_position"].values, atol=1e-12)
    kin = at(robot, data, 11)
    for name in robot.end_effector_names:
        place, _ = jffsr.end_effector_pose(robot, kin, name)
        np.testing.assert_allclose(ways[f"way of {name}"][11], place, atol=1e-12)


def test_arrows_are_the_momenta_of_the_parts(shown):
    """Against bodies moved by their rates over a short time: r x m v and I w summed by hand."""
    robot, data, replay = shown
    sample, mass = 17, np.asarray(robot.mass)
    before, after = at(robot, data, sample, -STEP), at(robot, data, sample, STEP)
    now = at(robot, data, sample)
    velocity = (after.com - before.com) / (2 * STEP)
    centre, drift = mass @ now.com / mass.sum(), mass @ velocity / mass.sum()
    turned = np.swapaxes(before.rotation, -1, -2)
    rates = Rotation.from_matrix(after.rotation @ turned).as_rotvec() / (2 * STEP)
    inertia = now.rotation @ np.asarray(robot.inertia) @ np.swapaxes(now.rotation, -1, -2)
    each = np.einsum("bij,bj->bi", inertia, rates) + mass[:, None] * np.cross(
        now.com - centre, velocity - drift
    )
    arrows = {arrow.name: arrow.vector[sample] for arrow in replay.arrows}
    base, arm = arrows["momentum of the base"], arrows["momentum of the arm"]
    scale = np.linalg.norm(base) / np.linalg.norm(each[0])
    np.testing.assert_allclose(base, scale * each[0], rtol=1e-5, atol=1e-8)
    np.testing.assert_allclose(arm, scale * each[1:].sum(axis=0), rtol=1e-5, atol=1e-8)
    assert replay.arrows[0].scale == pytest.approx(1 / scale)
    largest = np.linalg.norm(each[0])
    said = float(legend_of([replay])[-1].split("the longest is ")[1].split(" N m s")[0])
    lengths = [np.linalg.norm(arrow.vector, axis=1).max() for arrow in replay.arrows]
    assert said == pytest.approx(max(lengths) / np.linalg.norm(base) * largest, rel=1e-2)


def test_arrows_side_by_side_have_one_scale(shown):
    _, _, replay = shown
    larger = replace(replay, arrows=tuple(replace(arrow, scale=3.0 * arrow.scale) for arrow in replay.arrows))
    first, second = with_one_scale([replay, larger])
    for one, other in zip(first.arrows, second.arrows, strict=True):
        assert one.scale == other.scale
        np.testing.assert_allclose(3.0 * one.vector, other.vector)
    assert sum("Arrows" in line for line in legend_of([first, second])) == 1


def test_nothing_is_said_of_momentum_where_nothing_moves(robots):
    robot = robots["two_arms"]
    data = moving_dataset(robot)
    data["base_twist"] *= 0.0
    data["joint_velocity"] *= 0.0
    replay = robot_replay("still", robot, data)
    assert replay.arrows == ()
    assert not any("Arrows" in line for line in legend_of([replay]))


def test_nearness_is_one_at_the_limit(shown):
    robot, data, replay = shown
    near = joint_nearness(robot, data)
    chex.assert_shape(near, (41, robot.num_joints))
    # The first joint swings out to 1 rad, its limit, half way; its rate is largest at the ends, pi/10 of 0.5 rad/s.
    assert near[20, 0] == pytest.approx(1.0)
    assert near[0, 0] == pytest.approx(np.pi / 10 / 0.5)
    solids = {solid.name: solid for solid in replay.solids}
    np.testing.assert_array_equal(solids[f"{robot.joint_names[0]} joint"].nearness, near[:, 0])
    assert any(
        s.nearness is not None and s.nearness[-1] == 1.0 for name, s in solids.items() if "joint" not in name
    )
    unbounded = robot.replace(
        limits=Limits.symmetric(
            position=np.inf, velocity=np.inf, acceleration=np.inf, num_joints=robot.num_joints
        )
    )
    assert np.all(joint_nearness(unbounded, data) == 0.0)


def test_panels_have_units_of_their_own_for_sliding_joints(shown):
    robot, data, replay = shown
    panels = {(panel.title, panel.unit): panel for panel in replay.panels}
    turning = robot.topology.is_revolute
    position = panels["joint positions", "deg"]
    assert list(position.curves) == list(np.array(robot.joint_names)[turning])
    first = int(np.flatnonzero(turning)[0])
    np.testing.assert_allclose(
        position.curves[robot.joint_names[first]], np.rad2deg(data["joint_position"].values[:, first])
    )
    assert (("joint positions", "m") in panels) == bool(np.any(~turning))
    assert panels["base attitude", "deg"].curves["z"].max() == pytest.approx(5.0, rel=1e-3)
