"""Where a study puts its load: frames, momentum and the load that is known, in space and turned every way."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jffsr
from jffsr.compiling import jit
from jffsr.reactionless.estimation.balance import balance_of, load_blocks
from jffsr.reactionless.interface import Measured
from jffsr.reactionless.null_space import reaction_blocks
from jffsr.study.chain.carried_out import known_load
from jffsr.study.config import load_config
from jffsr.study.reactionless.building import build_study

CONFIG = """\
kind: reactionless
robot: wu_2018_6dof
task: {start_deg: [20, -50, 40, 30, 60, -10], base_quaternion: [0.5, 0.5, -0.5, 0.5]}
load:
  {mass: 30, inertia: [2, 3, 4], position: [0.1, -0.2, 0.3], rotation_vector: [0.4, -0.3, 0.9],
   velocity: [0.02, -0.01, 0.03], angular_velocity: [0.1, -0.2, 0.15]}
"""


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    file = tmp_path_factory.mktemp("load") / "study.yaml"
    file.write_text(CONFIG)
    config = load_config(file)
    study = build_study(config)
    state = jffsr.State(
        np.zeros(3), np.array([0.5, 0.5, -0.5, 0.5]), np.deg2rad([20.0, -50, 40, 30, 60, -10])
    )
    kin = jffsr.kinematics(study.robot, state)
    tool, quaternion = jffsr.end_effector_pose(study.robot, kin)
    turn = Rotation.from_quat(np.asarray(quaternion), scalar_first=True)
    place = np.asarray(tool) + turn.apply([0.1, -0.2, 0.3])
    full = turn * Rotation.from_rotvec([0.4, -0.3, 0.9])
    return study, state, kin, place, full


def test_the_momentum_is_that_of_the_load_alone_about_the_common_centre(case):
    study, _, kin, place, full = case
    matrix = full.as_matrix()
    spin, velocity = np.array([0.1, -0.2, 0.15]), np.array([0.02, -0.01, 0.03])
    mass = float(np.sum(study.robot.mass))
    centre = (mass * np.asarray(jffsr.system_com(study.robot, kin)) + 30 * place) / (mass + 30)
    angular = matrix @ np.diag([2.0, 3, 4]) @ matrix.T @ spin + 30 * np.cross(place - centre, velocity)
    np.testing.assert_allclose(study.compound.momentum[:3], 30 * velocity, atol=1e-12)
    np.testing.assert_allclose(study.compound.momentum[3:], angular, atol=1e-12)


def blocks_with(study, load):
    """Of the robot with a load in its tool, in B, and of the welded compound, turned there."""
    after = study.compound.state
    measured = Measured(
        after.base_quaternion, np.zeros(3), np.zeros(6), after.joint_position, np.zeros(6), jnp.array(True)
    )

    @jit
    def both(robot, whole, load):
        balance = balance_of(robot, measured)
        return balance, load_blocks(balance, load), reaction_blocks(whole, jffsr.kinematics(whole, after))

    balance, added, (locked, coupling) = both(study.robot, study.compound.robot, load)
    rotation = np.asarray(balance.rotation)
    ours = balance.locked + added[0], balance.coupling + added[1]
    return ours, (rotation.T @ locked @ rotation, rotation.T @ coupling)


def test_the_known_load_is_the_one_that_was_welded(case):
    study, state, _, place, full = case
    still = replace(state, base_twist=np.zeros(6), joint_velocity=np.zeros(6))
    # As a chain finds it, from the states of robot and target at the grasp.
    target = jffsr.Target.create([2.0, 3.0, 4.0], 30.0)
    there = jffsr.TargetState.create(
        place, [0.02, -0.01, 0.03], full.as_quat(scalar_first=True), full.inv().apply([0.1, -0.2, 0.15])
    )
    chain = SimpleNamespace(robot=study.robot, target=target, end_effector=study.end_effector)
    found = known_load(chain, still, there, study.compound)
    for known in (study.known, found):
        for ours, welded in zip(*blocks_with(study, known.load), strict=True):
            np.testing.assert_allclose(ours, welded, atol=1e-9)
        np.testing.assert_array_equal(known.angular_momentum, study.compound.momentum[3:])


@pytest.mark.parametrize(
    ("override", "sentence"),
    [
        (
            "hold.controller=passivity_based",
            "controller: 'passivity_based' adapts a load on the first end effector",
        ),
        ("strike.time=1", "the pendulum strikes the first end effector"),
    ],
)
def test_what_acts_on_the_first_tool_alone_is_refused_for_another(override, sentence, tmp_path):
    robot = jffsr.load_robot("dual_arm_servicer")
    second = robot.end_effector_names[1]
    file = tmp_path / "study.yaml"
    file.write_text(
        f"kind: reactionless\nrobot: dual_arm_servicer\n"
        f"load: {{mass: 5, inertia: [1, 1, 1], angular_velocity: [0, 0, 0.1]}}\n"
        f"task: {{start: {[0.1] * robot.num_joints}, end_effector: {second}}}\n"
    )
    with pytest.raises(jffsr.InputError, match=sentence):
        build_study(load_config(file, [override]))
