"""Kinematics, inertia and momentum against the oracle files: 30 random states of each of two robots."""

from __future__ import annotations

from pathlib import Path

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.dynamics.equations_of_motion import bias_force, forward_dynamics, inverse_dynamics
from jffsr.dynamics.kinematics import end_effector_pose, jacobians, kinematics, system_com
from jffsr.dynamics.momentum import (
    base_twist,
    generalized_inertia,
    generalized_jacobian,
    inertia_blocks,
    kinetic_energy,
    momentum,
)
from jffsr.robots.loading import load_robot
from jffsr.robots.state import State
from jffsr.spatial.rotation import quaternion_to_matrix

DATA = Path(__file__).parents[1] / "data"
TOLERANCE = 1e-11
QUANTITIES = [
    "H_b", "H_bm", "H_m", "H_reduced", "system_com", "momentum", "base_twist_zero_momentum",
    "base_twist_given_momentum", "kinetic_energy", "kinetic_energy_zero_momentum", "tool_position",
    "tool_rotation", "tool_quaternion", "tool_twist", "J_b", "J_m", "GJM", "tool_twist_zero_momentum",
    "bias_c", "bias_c_zero_momentum", "acceleration", "acceleration_zero_momentum", "inverse_torque",
    "inverse_base_acceleration",
]  # fmt: skip


def _cases(data: dict) -> list[dict]:
    home = [data["paper_home_case"]] if "paper_home_case" in data else []
    return data["cases"] + home


def _inputs(cases: list[dict]) -> dict[str, np.ndarray]:
    """Inputs stacked over the cases; the given angular momentum is moved to the system's centre."""
    read = {key: np.array([c["inputs"][key] for c in cases]) for key in cases[0]["inputs"]}
    com = np.array([c["outputs"]["system_com"] for c in cases])
    about_com = read["given_L_origin"] - np.cross(com, read["given_P"])
    read["their_joint_acceleration"] = np.array([c["outputs"]["acceleration"][6:] for c in cases])
    read["given_momentum"] = np.concatenate([read["given_P"], about_com], axis=1)
    return read


def _expected(cases: list[dict]) -> dict[str, np.ndarray]:
    out = [c["outputs"] for c in cases]
    tool = [o["end_effectors"][0] for o in out]
    expected = {key: np.array([o[key] for o in out]) for key in QUANTITIES if key in out[0]}
    expected["momentum"] = np.array([o["total_P"] + o["total_L_com"] for o in out])
    # Inverse dynamics is given their joint accelerations, and must find their torques and base acceleration.
    expected["inverse_torque"] = np.array([c["inputs"]["tau"] for c in cases])
    expected["inverse_base_acceleration"] = expected["acceleration"][:, :6]
    for ours, theirs in (
        ("tool_position", "position"), ("tool_rotation", "R"), ("tool_quaternion", "quat_wxyz"),
        ("tool_twist", "twist"), ("J_b", "J_b"), ("J_m", "J_m"), ("GJM", "GJM"),
    ):  # fmt: skip
        expected[ours] = np.array([t[theirs] for t in tool])
    w = expected["tool_quaternion"][:, :1]
    expected["tool_quaternion"] *= np.where(w < 0, -1, 1)
    rates = np.array([c["inputs"]["qd"] for c in cases])
    expected["tool_twist_zero_momentum"] = np.einsum("kij,kj->ki", expected["GJM"], rates)
    return expected


def _evaluate(robot, inputs):
    """Every quantity of one state."""
    q, qd, nu = inputs["q"], inputs["qd"], inputs["base_twist"]
    state = State(inputs["base_position"], inputs["base_quat_wxyz"], q)
    kin = kinematics(robot, state)
    h_b, h_bm, h_m = inertia_blocks(robot, kin)
    j_b, j_m = jacobians(robot, kin)
    position, quaternion = end_effector_pose(robot, kin)
    still = base_twist(robot, kin, qd)
    torque = inputs["tau"]
    inverse_torque, reaction = inverse_dynamics(robot, kin, nu, qd, inputs["their_joint_acceleration"])
    return {
        "bias_c": bias_force(robot, kin, nu, qd),
        "bias_c_zero_momentum": bias_force(robot, kin, still, qd),
        "acceleration": forward_dynamics(robot, kin, nu, qd, torque),
        "acceleration_zero_momentum": forward_dynamics(robot, kin, still, qd, torque),
        "inverse_torque": inverse_torque,
        "inverse_base_acceleration": reaction,
        "H_b": h_b,
        "H_bm": h_bm,
        "H_m": h_m,
        "H_reduced": generalized_inertia(robot, kin),
        "system_com": system_com(robot, kin),
        "momentum": momentum(robot, kin, nu, qd),
        "base_twist_zero_momentum": still,
        "base_twist_given_momentum": base_twist(robot, kin, qd, inputs["given_momentum"]),
        "kinetic_energy": kinetic_energy(robot, kin, nu, qd),
        "kinetic_energy_zero_momentum": kinetic_energy(robot, kin, still, qd),
        "tool_position": position,
        "tool_rotation": quaternion_to_matrix(quaternion),
        "tool_quaternion": quaternion,
        "tool_twist": j_b @ nu + j_m @ qd,
        "J_b": j_b,
        "J_m": j_m,
        "GJM": generalized_jacobian(robot, kin),
        "tool_twist_zero_momentum": j_b @ still + j_m @ qd,
    }


@pytest.fixture(scope="module", params=["wu6", "planar2"])
def compared(request, oracles):
    """Ours, of the robot in the URDF file, and the oracle's numbers of all cases; ours from one compiled call."""
    cases = _cases(oracles[request.param].data)
    robot = load_robot(DATA / "oracle" / f"{request.param}.urdf")
    ours = jax.jit(jax.vmap(_evaluate, in_axes=(None, 0)))(robot, _inputs(cases))
    return ours, _expected(cases)


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_agrees_with_the_oracle(compared, quantity):
    ours, expected = compared
    chex.assert_shape(ours[quantity], expected[quantity].shape)
    assert len(expected[quantity]) >= 30
    np.testing.assert_allclose(ours[quantity], expected[quantity], rtol=TOLERANCE, atol=TOLERANCE)


def test_the_oracles_cover_every_quantity_compared(compared):
    ours, expected = compared
    assert set(ours) == set(expected) == set(QUANTITIES)


def test_the_catalogue_robot_is_the_oracles(oracles):
    """wu_6dof is the same robot number for number, names of links and joints included."""
    ours, theirs = load_robot("wu_6dof"), oracles["wu6"].robot
    topology = ours.topology
    assert topology.parents == theirs.topology.parents
    assert topology.joint_types == theirs.topology.joint_types
    assert topology.joint_names == theirs.topology.joint_names
    assert topology.body_names == theirs.topology.body_names
    assert topology.end_effector_bodies == theirs.topology.end_effector_bodies
    chex.assert_trees_all_close(
        jax.tree.leaves(ours.replace(limits=None)),
        jax.tree.leaves(theirs.replace(limits=None)),
        rtol=0,
        atol=1e-15,
    )


def test_the_catalogue_planar_arm_is_ten_times_the_oracles(oracles):
    ours, theirs = load_robot("hu_2011_planar2"), oracles["planar2"].robot
    scaled = theirs.replace(mass=10 * theirs.mass, inertia=10 * theirs.inertia)
    chex.assert_trees_all_close(
        jax.tree.leaves(ours.replace(limits=None)),
        jax.tree.leaves(scaled.replace(limits=None)),
        rtol=1e-15,
        atol=1e-15,
    )


def test_one_state_without_vmap_gives_the_same(oracles):
    """Plain calls on one state, outside jit, take the same path as the batch above."""
    oracle = oracles["planar2"]
    case = oracle.data["cases"][3]
    state = State(
        jnp.array(case["inputs"]["base_position"]),
        jnp.array(case["inputs"]["base_quat_wxyz"]),
        jnp.array(case["inputs"]["q"]),
    )
    kin = kinematics(oracle.robot, state)
    h_b, _, _ = inertia_blocks(oracle.robot, kin)
    np.testing.assert_allclose(h_b, case["outputs"]["H_b"], rtol=TOLERANCE, atol=TOLERANCE)
