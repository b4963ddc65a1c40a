"""Robot and target as one after the grasp: the paper's planar figures, MuJoCo's inertia, gradients."""

from __future__ import annotations

import dataclasses
from dataclasses import replace

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from contact_cases import INERTIA, ROBOT, STATE, TARGET, TARGET_STATE, planar_meeting
from scipy.spatial.transform import Rotation

import jffsr
from jffsr.crosscheck.mujoco_model import to_mjspec
from jffsr.robots.builder import build_robot
from jffsr.robots.description import EndEffectorDescription
from jffsr.robots.loading import describe_robot


@pytest.fixture(scope="module")
def compound():
    return jax.jit(jffsr.grasped)(ROBOT, STATE, TARGET, TARGET_STATE)


def test_the_state_is_what_the_momentum_asks_for(compound):
    kin = jffsr.kinematics(compound.robot, compound.state)
    rates = compound.state.joint_velocity
    after = jffsr.momentum(compound.robot, kin, compound.state.base_twist, rates)
    np.testing.assert_allclose(after, compound.contact.momentum_before, rtol=0, atol=1e-12)
    np.testing.assert_allclose(compound.momentum, compound.contact.momentum_before, rtol=0, atol=1e-12)
    twist = jffsr.base_twist(compound.robot, kin, rates, compound.momentum)
    np.testing.assert_allclose(twist, compound.state.base_twist, rtol=0, atol=1e-13)
    energy = jffsr.kinetic_energy(compound.robot, kin, twist, rates)
    own = jffsr.kinetic_energy(ROBOT, jffsr.kinematics(ROBOT, STATE), STATE.base_twist, STATE.joint_velocity)
    turning = TARGET_STATE.angular_velocity_T
    target = 0.5 * (60.0 * TARGET_STATE.velocity @ TARGET_STATE.velocity + turning @ INERTIA @ turning)
    np.testing.assert_allclose(own + target - energy, compound.contact.energy_lost, rtol=1e-10)


def test_the_compounds_inertia_is_mujocos(compound):
    """MuJoCo keeps the target as a body of its own on the tool's."""
    spec = to_mjspec(ROBOT)
    tool, quaternion = jffsr.end_effector_pose(ROBOT, jffsr.kinematics(ROBOT, STATE))
    turned = Rotation.from_quat(quaternion, scalar_first=True).inv()
    here = turned * Rotation.from_quat(TARGET_STATE.quaternion, scalar_first=True)
    site = spec.sites[0]
    frame = Rotation.from_quat(site.quat, scalar_first=True)
    body = site.parent.add_body(
        name="target",
        pos=site.pos + frame.apply(turned.apply(TARGET_STATE.position - np.asarray(tool))),
        quat=(frame * here).as_quat(scalar_first=True),
    )
    body.explicitinertial = True
    body.mass, body.ipos = 60.0, np.zeros(3)
    body.fullinertia = [INERTIA[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = np.concatenate([STATE.base_position, STATE.base_quaternion, STATE.joint_position])
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    to_ours = np.eye(model.nv)
    to_ours[3:6, 3:6] = Rotation.from_quat(STATE.base_quaternion, scalar_first=True).as_matrix()
    h_b, h_bm, h_m = jffsr.inertia_blocks(compound.robot, jffsr.kinematics(compound.robot, compound.state))
    ours = np.block([[h_b, h_bm], [h_bm.T, h_m]])
    np.testing.assert_allclose(to_ours.T @ ours @ to_ours, mass, rtol=1e-10, atol=1e-9)


def test_the_planar_capture_of_paper_002():
    """Printed anchors: 1.25 N m s; 125.370 kg m^2 and 0.00997 rad/s with the joints locked; -0.00582 rad/s free."""
    robot, state, target, target_state = planar_meeting(0.1, 0.5)

    @jax.jit
    def both(state, target_state):
        return [
            jffsr.grasped(robot, state, target, target_state, joints=joints) for joints in ("locked", "free")
        ]

    locked, free = both(state, target_state)
    np.testing.assert_allclose(locked.momentum, [0, 0, 0, 0, 0, 1.25], atol=1e-14)
    kin = jffsr.kinematics(locked.robot, locked.state)
    h_b = np.asarray(jffsr.inertia_blocks(locked.robot, kin)[0])
    com = np.asarray(jffsr.system_com(locked.robot, kin))[0]
    about_com = h_b[5, 5] - 120.0 * com**2
    np.testing.assert_allclose(about_com, 125.370, atol=5e-4)
    np.testing.assert_allclose(locked.state.base_twist[5], 0.00997, atol=5e-6)
    np.testing.assert_allclose(locked.state.base_twist[5], 1.25 / about_com, rtol=1e-12)
    np.testing.assert_allclose(free.state.base_twist[5], -0.00582, atol=5e-6)
    np.testing.assert_allclose(free.momentum, locked.momentum, atol=1e-13)
    # Joints at rest do no work, locked or free; of 0.3125 J what the momentum does not ask for is lost.
    assert 0 < free.contact.energy_lost < locked.contact.energy_lost
    np.testing.assert_allclose(locked.contact.energy_lost, 0.3125 - 1.25**2 / about_com / 2, rtol=1e-12)


@pytest.mark.slow
def test_a_target_on_the_base_moves_its_centre_of_mass():
    whole = describe_robot("ye_2019_planar3")
    dock = EndEffectorDescription("dock", "base", np.array([-0.2, 0.1, 0.0]), np.eye(3))
    robot = build_robot(dataclasses.replace(whole, end_effectors=(*whole.end_effectors, dock)))
    _, state, target, target_state = planar_meeting(0.1, 0.5)
    state = replace(
        state, base_twist=jnp.array([0.1, 0, 0, 0, 0, 0.2]), joint_velocity=jnp.array([0.1, 0, 0.3])
    )
    beside = replace(target_state, position=jnp.array([-0.6, 0.1, 0.0]))
    found = jffsr.grasped(robot, state, target, beside, "dock")
    shift = np.array([-0.6, 0.1, 0.0]) * 5.0 / 105.0
    np.testing.assert_allclose(found.state.base_position, shift, atol=1e-15)
    kin = jffsr.kinematics(found.robot, found.state)
    np.testing.assert_allclose(
        jffsr.momentum(found.robot, kin, found.state.base_twist, found.state.joint_velocity),
        found.contact.momentum_before,
        atol=1e-13,
    )
    np.testing.assert_allclose(jffsr.end_effector_pose(found.robot, kin, "tip")[0], [3.5, 0, 0], atol=1e-14)


@pytest.mark.slow
def test_gradients_are_finite_differences():
    """Of the base's rate and the energy lost, by the target's mass, inertia and spin and the first joint."""

    robot, state, _, target_state = planar_meeting(0.3, 0.4)
    state = replace(
        state, base_twist=jnp.array([0.1, 0.05, -0.2, 0.1, -0.1, 0.2]), joint_velocity=jnp.ones(3)
    )

    def outcome(values):
        mass, scale, spin, joint = values
        target = jffsr.Target.create(scale * INERTIA, mass)
        turning = replace(target_state, angular_velocity_T=spin * jnp.array([0.1, 0.3, 0.4]))
        bent = replace(state, joint_position=jnp.array([0.3, -0.5, 0.4]).at[0].add(joint))
        found = jffsr.grasped(robot, bent, target, turning)
        kin = jffsr.kinematics(found.robot, found.state)
        turned = jffsr.base_twist(found.robot, kin, found.state.joint_velocity, found.momentum)[3:]
        return jnp.array([turned @ turned, found.contact.energy_lost, found.robot.inertia[3].trace()])

    at = jnp.array([60.0, 1.0, 1.0, 0.0])
    run = jax.jit(lambda x: (outcome(x), jax.jacrev(outcome)(x)))
    _, slope = run(at)
    h = 1e-4
    differences = np.stack([(run(at + h * e)[0] - run(at - h * e)[0]) / (2 * h) for e in np.eye(4)], axis=1)
    np.testing.assert_allclose(slope, differences, rtol=2e-6, atol=1e-8)
