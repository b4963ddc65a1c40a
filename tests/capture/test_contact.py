"""Impacts of a tool on a target: laws of conservation, closed forms, and MuJoCo's inertia and Jacobian."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from contact_cases import INERTIA, ROBOT, STATE, TARGET, TARGET_STATE, planar_meeting, with_rates
from scipy.spatial.transform import Rotation

import jffsr
from jffsr.capture.contact import DIRECTIONS
from jffsr.crosscheck.mujoco_model import to_mjspec
from jffsr.errors import InputError
from jffsr.target.grasp_frames import fixed_frame

CHOSEN = ("z", "x", "ry")
NORMAL = np.array([-1.0, -2.0, 0.5])


@pytest.fixture(scope="module")
def impacts():
    """Impacts of all kinds at the same meeting, from one program."""

    def all_kinds(state, target_state):
        grasp = partial(jffsr.grasp_impact, ROBOT, state, TARGET, target_state)
        point = partial(jffsr.point_impact, ROBOT, state, TARGET, target_state)
        normal = jnp.array(NORMAL)
        return {
            "rigid": grasp(),
            "locked": grasp(joints="locked"),
            "chosen": grasp(directions=CHOSEN),
            "soft": point(normal, 0.3),
            "elastic": point(normal, 1.0),
            "other side": point(-normal, 1.0),
        }

    return jax.jit(all_kinds)(STATE, TARGET_STATE)


def twists(contact) -> tuple[np.ndarray, np.ndarray]:
    """Twists of tool and target at the tool afterwards."""
    kin = jffsr.kinematics(ROBOT, contact.state)
    j_b, j_m = jffsr.jacobians(ROBOT, kin)
    own = j_b @ contact.state.base_twist + j_m @ contact.state.joint_velocity
    back = Rotation.from_quat(TARGET_STATE.quaternion, scalar_first=True).inv()
    there = back.apply(np.asarray(contact.point) - TARGET_STATE.position)
    _, _, target = fixed_frame(contact.target_state, there, jnp.array([1.0, 0, 0, 0]))
    return np.array(own), np.array(target)


def test_momentum_stays_and_energy_is_never_gained(impacts):
    for name, contact in impacts.items():
        np.testing.assert_allclose(
            contact.momentum_after, contact.momentum_before, rtol=0, atol=1e-12, err_msg=name
        )
    lost = {name: float(contact.energy_lost) for name, contact in impacts.items()}
    assert lost["rigid"] > lost["chosen"] > 0
    assert lost["soft"] > 1e-5
    assert abs(lost["elastic"]) < 1e-13
    assert lost["other side"] == 0
    # The impulse does work at the mean of the relative velocities before and after.
    for name in ("rigid", "chosen", "soft"):
        contact = impacts[name]
        before = twists(replace(contact, state=STATE, target_state=TARGET_STATE))
        after = twists(contact)
        mean = (before[0] - before[1] + after[0] - after[1]) / 2
        np.testing.assert_allclose(lost[name], -np.asarray(contact.impulse) @ mean, rtol=1e-9)


def test_total_momentum_is_the_sum_over_all_bodies(impacts):
    kin = jffsr.kinematics(ROBOT, STATE)
    own = np.asarray(jffsr.momentum(ROBOT, kin, STATE.base_twist, STATE.joint_velocity))
    own_com = np.asarray(jffsr.system_com(ROBOT, kin))
    turned = Rotation.from_quat(TARGET_STATE.quaternion, scalar_first=True)
    linear = 60.0 * TARGET_STATE.velocity
    spin = turned.apply(INERTIA @ TARGET_STATE.angular_velocity_T)
    mass = ROBOT.mass.sum()
    centre = (mass * own_com + 60.0 * TARGET_STATE.position) / (mass + 60.0)
    about_origin = own[3:] + np.cross(own_com, own[:3]) + spin + np.cross(TARGET_STATE.position, linear)
    total = own[:3] + linear
    expected = np.concatenate([total, about_origin - np.cross(centre, total)])
    np.testing.assert_allclose(impacts["rigid"].momentum_before, expected, rtol=0, atol=1e-12)


def test_after_a_grasp_tool_and_target_move_alike(impacts):
    for name in ("rigid", "locked"):
        own, target = twists(impacts[name])
        np.testing.assert_allclose(own, target, rtol=0, atol=1e-13)
    assert np.array_equal(impacts["locked"].state.joint_velocity, STATE.joint_velocity)
    contact = impacts["chosen"]
    _, quaternion = jffsr.end_effector_pose(ROBOT, jffsr.kinematics(ROBOT, STATE))
    back = Rotation.from_quat(quaternion, scalar_first=True).inv()
    own, target = (np.concatenate([back.apply(t[:3]), back.apply(t[3:])]) for t in twists(contact))
    impulse = np.concatenate([back.apply(np.array(contact.impulse[k : k + 3])) for k in (0, 3)])
    met = np.isin(DIRECTIONS, CHOSEN)
    np.testing.assert_allclose((own - target)[met], 0, atol=1e-13)
    assert np.all(np.abs((own - target)[~met]) > 1e-4)
    np.testing.assert_allclose(impulse[~met], 0, atol=1e-13)


def test_restitution_turns_the_normal_velocity_round(impacts):
    normal = NORMAL / np.linalg.norm(NORMAL)
    before = twists(replace(impacts["rigid"], state=STATE, target_state=TARGET_STATE))
    approach = normal @ (before[0] - before[1])[:3]
    assert approach < -0.01
    for name, restitution in (("soft", 0.3), ("elastic", 1.0)):
        after = twists(impacts[name])
        np.testing.assert_allclose(normal @ (after[0] - after[1])[:3], -restitution * approach, rtol=1e-11)
        size = np.linalg.norm(impacts[name].impulse)
        np.testing.assert_allclose(impacts[name].impulse, [*(size * normal), 0, 0, 0], rtol=0, atol=1e-14)
    # With the normal turned round they part already.
    assert np.all(np.asarray(impacts["other side"].impulse) == 0)


@pytest.fixture(scope="module")
def point_on_planar():
    robot, state, target, target_state = planar_meeting(0.2, 0.0)

    def run(base_twist, velocity, normal, restitution):
        return jffsr.point_impact(
            robot,
            with_rates(state, base_twist, jnp.zeros(3)),
            target,
            replace(target_state, velocity=velocity),
            normal,
            restitution,
            joints="locked",
        )

    return robot, jax.jit(run)


@pytest.mark.parametrize("restitution", [0.0, 0.6, 1.0])
def test_a_central_impact_is_that_of_two_spheres(point_on_planar, restitution):
    _, run = point_on_planar
    first, second = 115.0, 5.0
    contact = run(jnp.array([0.3, 0, 0, 0, 0, 0]), jnp.array([-0.1, 0.2, 0]), [-2.0, 0, 0], restitution)
    effective = 1 / (1 / first + 1 / second)
    np.testing.assert_allclose(contact.impulse[0], -(1 + restitution) * effective * 0.4, rtol=1e-12)
    np.testing.assert_allclose(contact.impulse[1:], 0, atol=1e-15)
    common = (first * 0.3 - second * 0.1) / (first + second)
    np.testing.assert_allclose(
        contact.state.base_twist, [common - restitution * 0.4 * second / 120, 0, 0, 0, 0, 0], atol=1e-13
    )
    np.testing.assert_allclose(
        contact.target_state.velocity, [common + restitution * 0.4 * first / 120, 0.2, 0], atol=1e-13
    )
    np.testing.assert_allclose(
        contact.energy_lost, 0.5 * effective * 0.16 * (1 - restitution**2), rtol=1e-10, atol=1e-14
    )


def test_an_eccentric_impact_feels_the_lever(point_on_planar):
    robot, run = point_on_planar
    contact = run(jnp.zeros(6), jnp.array([0, 0.5, 0]), [0, 1.0, 0], 0.4)
    com = np.array([0.0, 1.0, 2.0, 3.0])
    masses = robot.mass
    mean = masses @ com / 115.0
    about = 6.67 + 3 * 0.2 + masses @ (com - mean) ** 2
    effective = 1 / (1 / 115.0 + (3.5 - mean) ** 2 / about + 1 / 5.0 + 0.2**2 / 2.5)
    np.testing.assert_allclose(contact.impulse[1], 1.4 * 0.5 * effective, rtol=1e-12)


def with_target(spec: mujoco.MjSpec, parent, free: bool, position, quaternion) -> None:
    body = parent.add_body(name="target", pos=position, quat=quaternion)
    if free:
        body.add_freejoint()
    body.explicitinertial = True
    body.mass, body.ipos = 60.0, np.zeros(3)
    body.fullinertia = [INERTIA[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]


def test_the_rigid_grasp_is_that_of_mujocos_inertia_and_jacobian(impacts):
    spec = to_mjspec(ROBOT)
    with_target(spec, spec.worldbody, True, TARGET_STATE.position, TARGET_STATE.quaternion)
    model = spec.compile()
    data = mujoco.MjData(model)
    own, free = slice(0, 13), slice(13, 19)
    data.qpos[:] = np.concatenate(
        [
            STATE.base_position,
            STATE.base_quaternion,
            STATE.joint_position,
            TARGET_STATE.position,
            TARGET_STATE.quaternion,
        ]
    )
    turn = Rotation.from_quat(STATE.base_quaternion, scalar_first=True)
    data.qvel[:] = np.concatenate(
        [
            STATE.base_twist[:3],
            turn.inv().apply(STATE.base_twist[3:]),
            STATE.joint_velocity,
            TARGET_STATE.velocity,
            TARGET_STATE.angular_velocity_T,
        ]
    )
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    tool, target = np.zeros((6, model.nv)), np.zeros((6, model.nv))
    mujoco.mj_jacSite(model, data, tool[:3], tool[3:], 0)
    mujoco.mj_jac(model, data, target[:3], target[3:], data.site_xpos[0], model.body("target").id)
    jacobian = tool - target
    solved = np.linalg.solve(mass, jacobian.T)
    impulse = -np.linalg.solve(jacobian @ solved, jacobian @ data.qvel)
    after = data.qvel + solved @ impulse

    contact = impacts["rigid"]
    np.testing.assert_allclose(contact.impulse, impulse, rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(contact.state.joint_velocity, after[own][6:], rtol=0, atol=1e-12)
    np.testing.assert_allclose(contact.state.base_twist[:3], after[:3], rtol=0, atol=1e-12)
    np.testing.assert_allclose(contact.state.base_twist[3:], turn.apply(after[3:6]), rtol=0, atol=1e-12)
    np.testing.assert_allclose(contact.target_state.velocity, after[free][:3], rtol=0, atol=1e-12)
    np.testing.assert_allclose(contact.target_state.angular_velocity_T, after[free][3:], rtol=0, atol=1e-12)


def test_what_makes_no_sense_is_refused():
    given = (ROBOT, STATE, TARGET, TARGET_STATE)
    with pytest.raises(InputError, match=r"allowed are some of x, y, z, rx, ry, rz"):
        jffsr.grasp_impact(*given, directions=("x", "roll"))
    with pytest.raises(InputError, match="directions are"):
        jffsr.grasp_impact(*given, directions=())
    with pytest.raises(InputError, match="each once"):
        jffsr.grasp_impact(*given, directions=("x", "x"))
    with pytest.raises(InputError, match="joints is 'loked'; allowed are 'free' and 'locked'"):
        jffsr.grasp_impact(*given, joints="loked")
    with pytest.raises(InputError, match=r"restitution is 1.2; a number in \[0, 1\]"):
        jffsr.point_impact(*given, normal=(0, 0, 1.0), restitution=1.2)
    with pytest.raises(InputError, match="normal is"):
        jffsr.point_impact(*given, normal=(0, 0, 0.0))
