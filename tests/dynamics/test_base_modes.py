"""Bases that are held: the same equations in MuJoCo on sliding joints or none, and motions along them."""

from __future__ import annotations

from pathlib import Path

import chex
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from motions import Quintic

from jffsr.crosscheck.mujoco_model import to_mjspec
from jffsr.dynamics.base_mode import ATTITUDE_HELD, BASE_MODES, FIXED, base_freedom
from jffsr.dynamics.equations_of_motion import forward_dynamics, inverse_dynamics
from jffsr.dynamics.kinematics import end_effector_pose, kinematics, system_com
from jffsr.dynamics.momentum import base_twist, generalized_inertia, generalized_jacobian, momentum
from jffsr.errors import InputError
from jffsr.robots.loading import load_robot
from jffsr.robots.state import State
from jffsr.rollouts.conservation import momentum_drift, momentum_from_poses
from jffsr.rollouts.reference import reference_rollout
from jffsr.rollouts.rollout import rollout

TREE = Path(__file__).parents[1] / "data" / "robots" / "tree_prismatic.yaml"
HELD = {ATTITUDE_HELD: 3, FIXED: 0}
MOMENTUM = np.array([3.0, -2.0, 1.0, 0.5, 1.5, -1.0])


class Setting:
    """A tree in a random state whose base moves as the mode allows, with torques."""

    def __init__(self):
        rng = np.random.default_rng(5)
        self.robot = load_robot(TREE)
        n = self.robot.num_joints
        quaternion = rng.normal(size=4)
        self.state = State(rng.normal(size=3), quaternion / np.linalg.norm(quaternion), rng.normal(size=n))
        self.linear, self.rate, self.torque = rng.normal(size=3), rng.normal(size=n), rng.normal(size=n)
        self.kin = kinematics(self.robot, self.state)

    def twist(self, mode: str) -> np.ndarray:
        return np.concatenate([self.linear if mode == ATTITUDE_HELD else np.zeros(3), np.zeros(3)])

    def in_mujoco(self, mode: str):
        """Inertia, bias and acceleration of a model whose base slides along the axes of I, or is part of it."""
        spec = to_mjspec(self.robot)
        base = spec.worldbody.first_body()
        spec.delete(base.first_joint())
        base.pos, base.quat = self.state.base_position, self.state.base_quaternion
        if mode == ATTITUDE_HELD:
            for k, name in enumerate("xyz"):
                # A slide's axis is resolved in the body's own frame.
                axis = np.asarray(self.kin.rotation[0]).T @ np.eye(3)[k]
                base.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
        model = spec.compile()
        data = mujoco.MjData(model)
        free = HELD[mode]
        data.qpos[:] = np.concatenate([np.zeros(free), self.state.joint_position])
        data.qvel[:] = np.concatenate([self.twist(mode)[:free], self.rate])
        data.ctrl[:] = self.torque
        mujoco.mj_forward(model, data)
        inertia = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, inertia)
        return inertia, data.qacc.copy()


@pytest.fixture(scope="module")
def setting():
    return Setting()


@pytest.mark.parametrize("mode", HELD)
def test_forward_and_inverse_dynamics_are_mujocos(setting, mode):
    free = HELD[mode]
    inertia, acceleration = setting.in_mujoco(mode)
    arguments = setting.robot, setting.kin, setting.twist(mode), setting.rate
    ours = np.asarray(forward_dynamics(*arguments, setting.torque, mode))
    np.testing.assert_allclose(ours[:free], acceleration[:free], rtol=1e-10, atol=1e-12)
    np.testing.assert_array_equal(ours[free:6], 0.0)
    np.testing.assert_allclose(ours[6:], acceleration[free:], rtol=1e-10, atol=1e-12)
    torque, base = inverse_dynamics(*arguments, acceleration[free:], mode)
    np.testing.assert_allclose(torque, setting.torque, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(base[:free], acceleration[:free], rtol=1e-10, atol=1e-12)
    reduced = inertia[free:, free:]
    if free:
        reduced = reduced - inertia[:free, free:].T @ np.linalg.solve(
            inertia[:free, :free], inertia[:free, free:]
        )
    np.testing.assert_allclose(
        generalized_inertia(setting.robot, setting.kin, mode), reduced, rtol=1e-11, atol=1e-12
    )


@pytest.mark.parametrize("mode", BASE_MODES)
def test_the_base_twist_has_the_momentum_that_the_mode_keeps(setting, mode):
    twist = base_twist(setting.robot, setting.kin, setting.rate, MOMENTUM, mode)
    free = base_freedom(mode)
    np.testing.assert_array_equal(twist[free:], 0.0)
    found = momentum(setting.robot, setting.kin, twist, setting.rate)
    np.testing.assert_allclose(found[:free], MOMENTUM[:free], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("mode", BASE_MODES)
def test_the_generalized_jacobian_is_the_derivative_of_the_tool(setting, mode):
    """Against differences of tool positions along the motion that the mode's base twist drives."""
    robot, state, h = setting.robot, setting.state, 1e-6
    twist = np.asarray(base_twist(robot, setting.kin, setting.rate, base_mode=mode))
    ahead, behind = (
        end_effector_pose(robot, kinematics(robot, _moved(state, twist, setting.rate, sign * h)))[0]
        for sign in (1, -1)
    )
    speed = generalized_jacobian(robot, setting.kin, base_mode=mode)[:3] @ setting.rate
    np.testing.assert_allclose((ahead - behind) / (2 * h), speed, rtol=0, atol=1e-8)


def _moved(state, twist, rate, time):
    spin = np.concatenate([[1.0], 0.5 * time * twist[3:]])
    w, x, y, z = spin / np.linalg.norm(spin)
    a, b, c, d = state.base_quaternion
    turned = [
        w * a - x * b - y * c - z * d,
        w * b + x * a + y * d - z * c,
        w * c - x * d + y * a + z * b,
        w * d + x * c - y * b + z * a,
    ]
    return State(state.base_position + time * twist[:3], np.array(turned), state.joint_position + time * rate)


@pytest.fixture(scope="module", params=HELD)
def motions(request, setting):
    """The same held motion by both paths."""
    n = setting.robot.num_joints
    trajectory = Quintic(np.zeros(n), np.array([0.8, 0.3, -0.7, 1.1]), np.array(4.0))
    return [
        jax.jit(
            lambda robot, path=path: path(
                robot, trajectory, setting.state, num_steps=40, momentum=MOMENTUM, base_mode=request.param
            )
        )(setting.robot)
        for path in (rollout, reference_rollout)
    ]


def test_both_paths_hold_the_base(motions, setting):
    fast, plain = motions
    chex.assert_trees_all_equal_shapes(fast, plain)
    chex.assert_trees_all_close(fast, plain, rtol=0, atol=2e-7)
    for motion in motions:
        attitude = np.broadcast_to(setting.state.base_quaternion, motion.base_quaternion.shape)
        np.testing.assert_allclose(motion.base_quaternion, attitude, rtol=0, atol=1e-15)
        np.testing.assert_array_equal(motion.base_twist[:, 3:], 0.0)


def test_what_the_mode_keeps_is_kept(motions, setting):
    for motion in motions:
        poses = momentum_from_poses(setting.robot, motion)
        if motion.base_mode == FIXED:
            np.testing.assert_array_equal(motion.base_position - setting.state.base_position, 0.0)
            assert float(momentum_drift(setting.robot, motion)) == 0.0
            continue
        np.testing.assert_allclose(poses[:, :3], np.broadcast_to(MOMENTUM[:3], poses[:, :3].shape), atol=1e-5)
        assert float(momentum_drift(setting.robot, motion)) < 1e-5
        assert np.ptp(poses[:, 3:], axis=0).max() > 0.1  # what holds the attitude takes this up
        assert np.ptp(motion.base_position, axis=0).max() > 0.01


def test_the_centre_of_mass_goes_straight_with_the_attitude_held(motions, setting):
    fast = motions[0]
    if fast.base_mode == FIXED:
        np.testing.assert_array_equal(fast.base_twist, 0.0)
        return
    com = jax.vmap(lambda r, p, q: system_com(setting.robot, kinematics(setting.robot, State(r, p, q))))(
        fast.base_position, fast.base_quaternion, fast.joint_position
    )
    line = com[0] + fast.time[:, None] * MOMENTUM[:3] / np.sum(setting.robot.mass)
    np.testing.assert_allclose(com, line, rtol=0, atol=1e-13)


def test_a_held_base_is_the_limit_of_a_heavy_one(setting):
    """A base of 1e9 times the inertia barely turns; of 1e9 times the mass as well, it barely moves."""
    robot, kin = setting.robot, setting.kin
    inertia = np.array(robot.inertia)
    inertia[0] *= 1e9
    stiff = robot.replace(inertia=inertia)
    anchored = stiff.replace(mass=np.concatenate([robot.mass[:1] * 1e9, robot.mass[1:]]))
    for heavy, mode in ((stiff, ATTITUDE_HELD), (anchored, FIXED)):
        twist = setting.twist(mode)
        limit = forward_dynamics(heavy, kinematics(heavy, setting.state), twist, setting.rate, setting.torque)
        held = forward_dynamics(robot, kin, twist, setting.rate, setting.torque, mode)
        np.testing.assert_allclose(held, limit, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("name", ["free", "Floating", None])
def test_an_unknown_mode_is_refused(setting, name):
    with pytest.raises(InputError, match=r"base_mode is .*; allowed are floating, attitude_held, fixed"):
        base_twist(setting.robot, setting.kin, jnp.asarray(setting.rate), base_mode=name)
