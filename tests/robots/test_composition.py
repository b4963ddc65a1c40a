"""A robot put together from parts is the one that a flat description, MuJoCo and Newton's laws make of them."""

from __future__ import annotations

import dataclasses

import chex
import jax
import mujoco
import numpy as np
import pytest
from composition_parts import INERTIA, POSITION, QUATERNION, TWO_ARMS, furnished, turn

import jffsr
from jffsr.crosscheck.mujoco_model import to_mjspec
from jffsr.robots.builder import build_robot
from jffsr.robots.description import (
    FIXED,
    JointDescription,
    LinkDescription,
    RobotDescription,
)


def spin(vector) -> np.ndarray:
    return np.cross(np.eye(3), vector)


def flat(host, arm, seat, base) -> RobotDescription:
    """Host and arm as one description: the arm's root link is fixed on a link of the host.

    seat is that link and the pose of the arm's root link in it.
    """
    link, position, rotation = seat
    stays = {arm.links[0].name, "antenna"}

    def own(part):
        return dataclasses.replace(part, name="b_" + part.name)

    links = [
        own(LinkDescription.frame(part.name) if base == "drop" and part.name in stays else part)
        for part in arm.links
    ]
    mount = JointDescription("mount", FIXED, link, links[0].name, position, rotation, np.array([0.0, 0, 1]))
    joints = [
        dataclasses.replace(own(joint), parent="b_" + joint.parent, child="b_" + joint.child)
        for joint in arm.joints
    ]
    gone = stays if base == "drop" else ()
    tools = [dataclasses.replace(own(t), link="b_" + t.link) for t in arm.end_effectors if t.link not in gone]
    shapes = [dataclasses.replace(own(s), body="b_" + s.body) for s in arm.shapes if s.body not in gone]
    return dataclasses.replace(
        host,
        links=(*host.links, *links),
        joints=(*host.joints, mount, *joints),
        end_effectors=(*host.end_effectors, *tools),
        shapes=(*host.shapes, *shapes),
    )


@pytest.mark.parametrize("base", ["keep", "drop"])
@pytest.mark.parametrize("link", [None, "base", "left", "dock", "right_slide"])
def test_it_is_the_robot_of_one_flat_description(link, base):
    """Every number, name and shape, on the base, on a moving body, and on tools of both."""
    host = arm = furnished()
    position, rotation = POSITION, turn(QUATERNION)
    parent = link or "base"
    for tool in host.end_effectors:
        if tool.name == link:
            parent = tool.link
            position, rotation = tool.position + tool.rotation @ position, tool.rotation @ rotation
    expected = build_robot(flat(host, arm, (parent, position, rotation), base))
    found = jffsr.attach(
        build_robot(host),
        build_robot(arm),
        position=POSITION,
        quaternion=QUATERNION,
        link=link,
        arm_base=base,
        prefix="b_",
    )
    assert found.topology == expected.topology
    finite = found.replace(limits=None, geometry=expected.geometry), expected.replace(limits=None)
    chex.assert_trees_all_close(*finite, rtol=0, atol=1e-13)
    chex.assert_trees_all_equal(found.limits, expected.limits)
    shapes = [
        {shape.name: shape for shape in robot.geometry.shapes if base == "keep" or shape.name != "b_hull"}
        for robot in (found, expected)
    ]
    assert shapes[0].keys() == shapes[1].keys()
    assert len(shapes[0]) == (4 if base == "keep" else 3)
    for name, shape in shapes[1].items():
        assert shapes[0][name].body == shape.body
        np.testing.assert_allclose(shapes[0][name].position, shape.position, rtol=0, atol=1e-13)
        np.testing.assert_allclose(shapes[0][name].rotation, shape.rotation, rtol=0, atol=1e-13)


def some_state(robot, seed=3):
    rng = np.random.default_rng(seed)
    quaternion = rng.normal(size=4)
    return jffsr.State(
        rng.normal(size=3), quaternion / np.linalg.norm(quaternion), rng.normal(size=robot.num_joints)
    )


def mujoco_inertia(spec, robot, state, base_position):
    """MuJoCo's inertia matrix in the robot's order of joints, its base at `base_position`."""
    model = spec.compile()
    data = mujoco.MjData(model)
    joints = [model.joint(name) for name in robot.joint_names]
    data.qpos[:7] = np.concatenate([base_position, state.base_quaternion])
    for joint, angle in zip(joints, state.joint_position, strict=True):
        data.qpos[joint.qposadr[0]] = angle
    mujoco.mj_forward(model, data)
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    order = [*range(6), *(joint.dofadr[0] for joint in joints)]
    assert model.nv == len(order)
    return matrix[np.ix_(order, order)]


@pytest.mark.parametrize("link", [None, "left_hand"])
def test_mujoco_attaches_the_same(link):
    """MuJoCo's own attachment of the two models has our inertia matrix, referred to its base's frame."""
    host, arm = jffsr.load_robot(TWO_ARMS), jffsr.load_robot("wu_6dof")
    robot = jffsr.attach(host, arm, position=POSITION, quaternion=QUATERNION, link=link, prefix="b_")
    spec, child = to_mjspec(host), to_mjspec(arm)
    child.delete(child.worldbody.first_body().first_joint())
    child.worldbody.first_body().pos = -arm.root_position
    frame = spec.body(link or "base").add_frame(
        pos=POSITION + (host.root_position if link is None else 0),
        quat=QUATERNION / np.linalg.norm(QUATERNION),
    )
    spec.attach(child, prefix="b_", frame=frame)

    state = some_state(robot)
    kin = jffsr.kinematics(robot, state)
    rotation = np.asarray(kin.rotation[0])
    moved = rotation @ (host.root_position - robot.root_position)
    theirs = mujoco_inertia(spec, robot, state, state.base_position - moved)
    # From [v_0; w_0; qd] in I to MuJoCo's velocity: of the old base centre of mass, angular part in B.
    to_theirs = np.eye(6 + robot.num_joints)
    to_theirs[:3, 3:6] = spin(moved)
    to_theirs[3:6, 3:6] = rotation.T
    h_b, h_bm, h_m = (np.asarray(block) for block in jffsr.inertia_blocks(robot, kin))
    ours = np.block([[h_b, h_bm], [h_bm.T, h_m]])
    expected = to_theirs.T @ theirs @ to_theirs
    np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-9)
    if link is None:
        assert np.linalg.norm(moved) > 0.1, "the base frame does not move: the test shows less"


def test_parts_placed_in_space_add_up():
    """Mass, centre of mass, momentum and energy of the compound are the sums of the parts' own."""
    host, arm = jffsr.load_robot(TWO_ARMS), jffsr.load_robot("hu_2011_planar2")
    place = dict(position=POSITION, quaternion=QUATERNION, link="right")
    robot = jffsr.attach(host, arm, **place, prefix="b_")
    state = some_state(robot)
    rng = np.random.default_rng(4)
    twist, rate = rng.normal(size=6), rng.normal(size=robot.num_joints)
    n = host.num_joints

    # The frame stays that of the host's base, for the arm hangs on a moving body.
    np.testing.assert_array_equal(robot.root_position, host.root_position)
    host_state = jffsr.State(state.base_position, state.base_quaternion, state.joint_position[:n])
    host_kin = jffsr.kinematics(host, host_state)
    tool, tool_quaternion = jffsr.end_effector_pose(host, host_kin, "right")
    attitude = turn(tool_quaternion) @ turn(QUATERNION)
    root = np.asarray(tool) + turn(tool_quaternion) @ POSITION
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, attitude.ravel())
    arm_state = jffsr.State(root - attitude @ arm.root_position, quaternion, state.joint_position[n:])
    j_b, j_m = jffsr.jacobians(host, host_kin, "right")
    tool_twist = np.asarray(j_b @ twist + j_m @ rate[:n])
    lever = arm_state.base_position - np.asarray(tool)
    arm_twist = np.concatenate([tool_twist[:3] + np.cross(tool_twist[3:], lever), tool_twist[3:]])

    parts = [(host, host_state, twist, rate[:n]), (arm, arm_state, arm_twist, rate[n:])]
    kin = jffsr.kinematics(robot, state)
    mass, first, linear, about_origin, energy = 0.0, 0.0, 0.0, 0.0, 0.0
    for part, at, nu, qd in parts:
        own = jffsr.kinematics(part, at)
        com, p = np.asarray(jffsr.system_com(part, own)), np.asarray(jffsr.momentum(part, own, nu, qd))
        mass, first = mass + part.mass.sum(), first + part.mass.sum() * com
        linear, about_origin = linear + p[:3], about_origin + p[3:] + np.cross(com, p[:3])
        energy += float(jffsr.kinetic_energy(part, own, nu, qd))
    com = first / mass
    np.testing.assert_allclose(robot.mass.sum(), mass, rtol=1e-15)
    np.testing.assert_allclose(jffsr.system_com(robot, kin), com, rtol=0, atol=1e-13)
    found = np.asarray(jffsr.momentum(robot, kin, twist, rate))
    expected = np.concatenate([linear, about_origin - np.cross(com, linear)])
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-11)
    np.testing.assert_allclose(jffsr.kinetic_energy(robot, kin, twist, rate), energy, rtol=1e-13)


@pytest.mark.parametrize("tool", ["left", "dock"])
def test_a_welded_target_brings_its_momentum(tool):
    """Momentum of the compound is that of the robot and of the target that moves with the tool."""
    robot = build_robot(furnished())
    target = jffsr.RigidBody.create(20.0, INERTIA, com=[0.2, -0.4, 0.6], name="target")
    compound = jffsr.weld(robot, target, end_effector=tool, position=POSITION, quaternion=QUATERNION)
    assert compound.topology == robot.topology
    state = some_state(robot)
    kin = jffsr.kinematics(robot, state)
    twist, rate = np.arange(1.0, 7.0), np.linspace(-0.5, 0.8, robot.num_joints)
    moved = turn(state.base_quaternion) @ (robot.root_position - compound.root_position)
    new_state = dataclasses.replace(state, base_position=state.base_position + moved)
    new_twist = np.concatenate([twist[:3] + np.cross(twist[3:], moved), twist[3:]])
    new_kin = jffsr.kinematics(compound, new_state)
    for name in robot.end_effector_names:
        chex.assert_trees_all_close(
            jffsr.end_effector_pose(robot, kin, name),
            jffsr.end_effector_pose(compound, new_kin, name),
            rtol=0,
            atol=1e-13,
        )

    position, quaternion = jffsr.end_effector_pose(robot, kin, tool)
    attitude = turn(quaternion) @ turn(QUATERNION)
    com = np.asarray(position) + turn(quaternion) @ POSITION + attitude @ target.com
    j_b, j_m = jffsr.jacobians(robot, kin, tool)
    at_tool = np.asarray(j_b @ twist + j_m @ rate)
    velocity = at_tool[:3] + np.cross(at_tool[3:], com - np.asarray(position))
    own = np.asarray(jffsr.momentum(robot, kin, twist, rate))
    own_com = np.asarray(jffsr.system_com(robot, kin))
    mass = robot.mass.sum()
    centre = (mass * own_com + 20.0 * com) / (mass + 20.0)
    linear = own[:3] + 20.0 * velocity
    angular = (
        own[3:]
        + np.cross(own_com - centre, own[:3])
        + attitude @ INERTIA @ attitude.T @ at_tool[3:]
        + np.cross(com - centre, 20.0 * velocity)
    )
    np.testing.assert_allclose(jffsr.system_com(compound, new_kin), centre, rtol=0, atol=1e-13)
    found = jffsr.momentum(compound, new_kin, new_twist, rate)
    np.testing.assert_allclose(found, np.concatenate([linear, angular]), rtol=1e-12, atol=1e-11)


def test_the_order_of_composition_does_not_matter():
    """Two arms on a bus, put on left first or right first, move the same: the same energies."""
    bus, arm = jffsr.RigidBody.create(300.0, INERTIA * 20, com=[0.1, 0.2, 0.3]), jffsr.load_robot("wu_6dof")
    left = dict(position=[0.0, 1.0, 0.0], prefix="left_")
    right = dict(position=[0.0, -1.0, 0.2], quaternion=QUATERNION, prefix="right_")
    one = jffsr.attach(jffsr.attach(bus, arm, **left), arm, **right)
    other = jffsr.attach(jffsr.attach(bus, arm, **right), arm, **left)
    q = np.linspace(-1, 1, 12)
    swapped = np.roll(q, 6)
    np.testing.assert_allclose(one.root_position, other.root_position, rtol=0, atol=1e-14)
    base = (np.zeros(3), np.array([1.0, 0, 0, 0]))
    blocks = [
        np.asarray(jffsr.generalized_inertia(robot, jffsr.kinematics(robot, jffsr.State(*base, angles))))
        for robot, angles in ((one, q), (other, swapped))
    ]
    order = np.roll(np.arange(12), 6)
    np.testing.assert_allclose(blocks[0], blocks[1][np.ix_(order, order)], rtol=0, atol=1e-11)


def test_host_data_stay_float64_without_x64():
    """All leaves are NumPy's, in float64, whatever JAX is set to."""
    with jax.enable_x64(False):
        bus = jffsr.RigidBody.create(50.0, [20, 30, 40], com=[0.1, 0, -0.2])
        robot = jffsr.attach(
            bus, jffsr.load_robot("wu_6dof"), position=(0.1, 0.2, 0.3), quaternion=(1, 2, 3, 4)
        )
        robot = jffsr.weld(robot, bus, position=[0.3, 0, 0])
        robot = jffsr.attach(robot, jffsr.load_robot(TWO_ARMS), link="link6", prefix="b_")
        robots = [robot, jffsr.load_robot("dual_arm_servicer")]
    for leaf in jax.tree.leaves(robots):
        assert type(leaf) is np.ndarray
        assert leaf.dtype == np.float64
