"""The reaction null space: blocks against the momentum, published anchors, priorities, axes, what cannot be held."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jffsr
from jffsr.crosscheck.mujoco_model import to_mjspec
from jffsr.reactionless.null_space import ReactionCode, reaction_blocks, reactionless_rates
from jffsr.tracking.redundancy import limit_gradient

ROBOT = jffsr.load_robot("servicer_7dof")
PLANAR = jffsr.load_robot("ye_2019_planar3")
JOINTS = np.deg2rad([10.0, -60.0, 20.0, 45.0, -30.0, -15.0, 5.0])
MOMENTUM = np.array([3.0, -2.0, 1.0, 4.0, 2.0, -3.0])


def random_state(seed: int = 3):
    rng = np.random.default_rng(seed)
    base = Rotation.random(rng=rng).as_quat(scalar_first=True)
    return jffsr.State(rng.normal(size=3), base, JOINTS + 0.1 * rng.normal(size=7))


@pytest.fixture(scope="module")
def captured():
    """Ye's robot and target, straight, right after a plastic capture with free joints; and rates under a momentum."""
    still = jffsr.State(np.zeros(3), np.array([1.0, 0, 0, 0]), np.zeros(3), np.zeros(6), np.zeros(3))
    target = jffsr.Target.create((2.5, 2.5, 2.5), 5.0)
    spinning = jffsr.TargetState.create((3.6, 0, 0), (0, 0, 0), (1, 0, 0, 0), (0, 0, 0.5))
    found = jax.jit(jffsr.grasped)(PLANAR, still, target, spinning)
    kin = jffsr.kinematics(found.robot, found.state)

    @jax.jit
    def rates(momentum):
        both = [reactionless_rates(found.robot, kin, momentum, axes=axes) for axes in ((0, 1, 2), (2,))]
        return *both, reaction_blocks(found.robot, kin)

    return found, kin, rates


@pytest.fixture(scope="module")
def spatial():
    """Everything of the seven-axis robot in one program."""

    @jax.jit
    def found(state, momentum, zeta, velocity):
        kin = jffsr.kinematics(ROBOT, state)
        j_b, j_m = jffsr.jacobians(ROBOT, kin)
        plain = reactionless_rates(ROBOT, kin, momentum, zeta)
        tool = reactionless_rates(ROBOT, kin, momentum, zeta, tool_velocity=velocity)
        return {
            "blocks": reaction_blocks(ROBOT, kin),
            "least": reactionless_rates(ROBOT, kin, momentum),
            "plain": plain,
            "tool": tool,
            "tool_twist": j_b @ tool.base_twist + j_m @ tool.joint_velocity,
            "two": reactionless_rates(ROBOT, kin, momentum, zeta, axes=(2, 0)),
            "base_twist": jffsr.base_twist(ROBOT, kin, plain.joint_velocity, momentum),
        }

    return found


def test_the_blocks_make_the_angular_momentum():
    """MuJoCo's angular momentum of the whole about its centre of mass, whatever the base's linear velocity."""
    model = to_mjspec(ROBOT).compile()
    data = mujoco.MjData(model)
    state, rng = random_state(), np.random.default_rng(5)
    twist, rates = rng.normal(size=6), rng.normal(size=7)
    data.qpos[:] = np.concatenate([state.base_position, state.base_quaternion, state.joint_position])
    turned = Rotation.from_quat(state.base_quaternion, scalar_first=True)
    data.qvel[:] = np.concatenate([twist[:3], turned.inv().apply(twist[3:]), rates])
    mujoco.mj_forward(model, data)
    mujoco.mj_subtreeVel(model, data)
    locked, coupling = reaction_blocks(ROBOT, jffsr.kinematics(ROBOT, state))
    np.testing.assert_allclose(locked @ twist[3:] + coupling @ rates, data.subtree_angmom[0], rtol=1e-9)


def test_the_published_rates_after_capture(captured):
    """Errata of Ye 2019: (0.00877, 0.00533, 0.00238) rad/s for the straight arm; a planar coupling has rank 1."""
    found, kin, run = captured
    rates, _, (_, coupling) = run(found.momentum)
    np.testing.assert_allclose(rates.joint_velocity, [0.00877, 0.00533, 0.00238], atol=5e-6)
    assert int(rates.code) == ReactionCode.HELD
    assert int(rates.rank) == 1
    # The least of all that do it: along the row of the coupling itself.
    row = np.asarray(coupling[2])
    np.testing.assert_allclose(rates.joint_velocity, 1.25 * row / (row @ row), rtol=1e-12)
    twist = jffsr.base_twist(found.robot, kin, rates.joint_velocity, found.momentum)
    assert np.abs(twist[3:]).max() < 1e-12


def test_the_base_stands_still_under_any_momentum(spatial):
    zeta = np.random.default_rng(8).normal(size=7)
    for seed in range(5):
        found = spatial(random_state(seed), MOMENTUM * (seed + 1), zeta, np.zeros(3))
        assert np.abs(found["base_twist"][3:]).max() < 1e-12
        assert int(found["plain"].code) == ReactionCode.HELD
        assert int(found["plain"].rank) == 3
        coupling = np.asarray(found["blocks"][1])
        pinv = np.linalg.pinv(coupling)
        least = pinv @ (MOMENTUM[3:] * (seed + 1))
        np.testing.assert_allclose(found["least"].joint_velocity, least, atol=1e-11)
        np.testing.assert_allclose(
            found["plain"].joint_velocity, least + zeta - pinv @ coupling @ zeta, atol=1e-11
        )


def test_the_tool_moves_in_what_freedom_is_left(spatial):
    """Four freedoms are left: three for the tool's velocity, one for zeta."""
    velocity = np.array([0.02, -0.01, 0.03])
    state, zeta = random_state(), np.random.default_rng(9).normal(size=7)
    found = spatial(state, MOMENTUM, zeta, velocity)
    without = spatial(state, MOMENTUM, np.zeros(7), velocity)
    np.testing.assert_allclose(found["tool_twist"][:3], velocity, atol=1e-12)
    assert np.abs(found["tool"].base_twist[3:]).max() < 1e-12
    moved = np.asarray(found["tool"].joint_velocity - without["tool"].joint_velocity)
    assert np.linalg.norm(moved) > 0.1
    np.testing.assert_allclose(without["tool_twist"][:3], velocity, atol=1e-12)
    assert np.linalg.matrix_rank(found["tool"].space, tol=1e-9) == 1


def test_chosen_axes_alone_are_held(spatial):
    state = random_state()
    found = spatial(state, MOMENTUM, np.zeros(7), np.zeros(3))
    turned = Rotation.from_quat(state.base_quaternion, scalar_first=True).inv()
    rate = turned.apply(np.array(found["two"].base_twist[3:]))
    assert np.abs(rate[[0, 2]]).max() < 1e-12
    assert abs(rate[1]) > 1e-4
    assert int(found["two"].rank) == 2
    # Less is asked of the joints.
    assert np.linalg.norm(found["two"].joint_velocity) < np.linalg.norm(found["least"].joint_velocity)


def test_the_gradient_of_the_joint_limits_is_that_of_their_cost():
    q = JOINTS

    def cost(x):
        lower, upper = np.asarray(ROBOT.limits.position_lower), np.asarray(ROBOT.limits.position_upper)
        bounded = np.isfinite(lower) & np.isfinite(upper)
        return np.sum((((x - (lower + upper) / 2) / ((upper - lower) / 2)) ** 2 / 2)[bounded]) / x.size

    slope = [(cost(q + 1e-6 * e) - cost(q - 1e-6 * e)) / 2e-6 for e in np.eye(7)]
    np.testing.assert_allclose(limit_gradient(ROBOT, jnp.asarray(q)), slope, atol=1e-8)


def test_what_cannot_be_held_is_said(captured):
    """A planar arm takes up no momentum across its axis; the base's rate is what the locked inertia makes of it."""
    across = jnp.array([0.0, 0, 0, 0.3, 0, 1.25])
    rates, alone, (locked, _) = captured[2](across)
    assert int(rates.code) == ReactionCode.NOT_ABSORBED
    np.testing.assert_allclose(rates.base_twist[3], 0.3 / locked[0, 0], rtol=1e-9)
    assert abs(float(rates.base_twist[5])) < 1e-12
    gone, _, _ = captured[2](across.at[5].set(jnp.nan))
    assert int(gone.code) == ReactionCode.NOT_FINITE
    # Held about its own axis alone, the rest does not count.
    assert int(alone.code) == ReactionCode.HELD


@pytest.mark.parametrize("axes", [(), (0, 0), (3,), (1, -1)])
def test_axes_that_are_none_are_refused(axes, captured):
    found, kin, _ = captured
    with pytest.raises(jffsr.InputError, match="axes"):
        reactionless_rates(found.robot, kin, axes=axes)


def test_gradients_where_the_coupling_has_no_rank(captured):
    """Two singular values of the planar arm are zero, and equal: derivatives are differences all the same."""
    found, _, _ = captured

    def rates(q):
        kin = jffsr.kinematics(found.robot, replace(found.state, joint_position=q))
        return reactionless_rates(found.robot, kin, found.momentum, jnp.ones(3)).joint_velocity

    at = jnp.array([0.3, -0.8, 0.6])
    run = jax.jit(lambda q: (rates(q), jax.jacfwd(rates)(q)))
    h = 1e-6
    differences = np.stack([(run(at + h * e)[0] - run(at - h * e)[0]) / (2 * h) for e in np.eye(3)], axis=1)
    np.testing.assert_allclose(run(at)[1], differences, atol=1e-7)
    assert np.all(np.isfinite(run(jnp.zeros(3))[1]))
