"""The catalogue against what is published of its robots, by arithmetic that shares no code with the package."""

from __future__ import annotations

from itertools import product

import jax
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.robots.loading import describe_robot
from jffsr.robots.state import State


@jax.jit
def _poses(robot, postures):
    def one(posture):
        kin = kinematics(robot, State(np.zeros(3), np.array([1.0, 0, 0, 0]), posture))
        return (*end_effector_pose(robot, kin), kin.com)

    return jax.vmap(one)(postures)


def poses(robot, postures):
    """Tool position, tool rotation and centres of mass (k, b, 3) at postures (k, n), base at the origin."""
    position, quaternion, com = jax.device_get(_poses(robot, np.atleast_2d(postures)))
    return position, Rotation.from_quat(quaternion, scalar_first=True), com


# Dimitrov, model_ETS7.m: from a body's centre of mass to the next joint, from that joint to the next centre of
# mass, and the turn at zero about x, y and z in a row, in quarters of a circle.
ETS7 = [
    ([-0.785, -0.295, 1.0], [0, 0, 0.175], [0, 0, 0]),
    ([0, 0.275, 0.175], [0.435, 0, 0], [-1, 0, -1]),
    ([0.435, 0, 0], [0.315, 0, 0.275], [0, 0, 1]),
    ([0.315, 0, 0], [0, 0, -0.1335], [0, 0, -1]),
    ([0, 0, -0.1335], [0, 0, 0.1385], [1, 1, 0]),
    ([0, 0, 0.1385], [0, 0, 0.266], [2, 1, 0]),
]


def test_ets7_puts_its_centres_of_mass_where_spacedyn_does(robots):
    """SpaceDyn's recursion from centre of mass to centre of mass, the joint's angle turned last, about z."""
    rng = np.random.default_rng(3)
    postures = np.concatenate([np.zeros((1, 6)), rng.uniform(-np.pi, np.pi, (3, 6))])
    _, _, com = poses(robots["ets7_6dof"], postures)
    for posture, found in zip(postures, com, strict=True):
        place, turn = np.zeros(3), Rotation.identity()
        for body, (out, into, quarters) in enumerate(ETS7, start=1):
            angles = 0.5 * np.pi * np.array(quarters) + [0, 0, posture[body - 1]]
            place = place + turn.apply(out)
            turn = turn * Rotation.from_euler("XYZ", angles)
            place = place + turn.apply(into)
            np.testing.assert_allclose(found[body], place, atol=1e-12)


def test_ets7_has_the_published_masses(robots):
    robot = robots["ets7_6dof"]
    np.testing.assert_array_equal(robot.mass, [2552, 35.01, 22.45, 21.89, 16.54, 26.0, 18.49])
    # Yoshida and Abiko's base to three digits, as another transcription of it has them.
    rounded = [[6200, 48.2, 78.5], [48.2, 3540, -29.2], [78.5, -29.2, 7090]]
    np.testing.assert_allclose(robot.inertia[0], rounded, rtol=2e-3)


@pytest.mark.parametrize(
    ("body", "published"),
    [
        (2, [[0.102, 0, -0.00214], [0, 3.378, 0], [-0.00214, 0, 3.752]]),
        (3, [[0.4327, 0, -0.6328], [0, 2.266, 0], [-0.6328, 0, 2.528]]),
        (5, [[0.5727, 0, -0.2313], [0, 0.5987, 0], [-0.2313, 0, 0.1290]]),
    ],
)
def test_ets7_is_mended_as_its_notes_say(robots, body, published):
    moments, axes = np.linalg.eigh(published)
    assert moments[0] + moments[1] < moments[2]
    mended = axes @ np.diag([*moments[:2], 0.98 * moments[:2].sum()]) @ axes.T
    np.testing.assert_allclose(robots["ets7_6dof"].inertia[body], mended, atol=5e-6)
    notes = describe_robot("ets7_6dof").notes
    assert f"link{body} {moments[2]:.5f} to {0.98 * moments[:2].sum():.5f}" in notes


@pytest.mark.parametrize(
    "name", ["ets7_6dof", "astrobee_2dof", "canadarm2_7dof", "era_7dof", "vispa_6dof", "li_2022_7dof"]
)
def test_notes_tell_the_published_from_the_rest(name):
    notes = describe_robot(name).notes
    assert "PUBLISHED: " in notes
    assert "CHOSEN: " in notes or "SHAPES: ours" in notes
    assert ("MENDED: " in notes) == (name in ("ets7_6dof", "astrobee_2dof"))


def test_canadarm2_has_the_mass_and_the_length_of_its_data_sheet(robots):
    robot = robots["canadarm2_7dof"]
    whole = robot.mass.sum() - 100_000
    assert abs(whole - 1497) < 0.01 * 1497
    # The tallest of all postures at right angles, from where the foot stands to the tip.
    turns = 0.5 * np.pi * np.array([[0, *q, 0] for q in product((-1, 0, 1, 2), repeat=5)])
    tools, _, _ = poses(robot, turns)
    foot = 2.2 - 243.66 * 2.7 / 100_243.66  # the base's centre of mass lies a little up, towards the foot
    length = tools[:, 2].max() - foot
    assert abs(length - 17.6) < 0.05
    np.testing.assert_allclose(length, 2 * (1.0 + 0.175 + 7.61164), atol=1e-9)
    limits = robot.limits
    np.testing.assert_allclose(limits.position_upper, np.deg2rad(270))
    np.testing.assert_allclose(limits.velocity, 0.0698132, rtol=1e-6)


def test_era_has_the_mass_the_length_and_the_reach_of_its_fact_sheet(robots):
    robot = robots["era_7dof"]
    np.testing.assert_allclose(robot.mass.sum(), 20_350 + 630)
    # Every posture at right angles, from the foot's face; the base's centre of mass lies a little up, towards it.
    turns = 0.5 * np.pi * np.array([[0, *q, 0] for q in product((-1, 0, 1, 2), repeat=5)])
    tools, _, _ = poses(robot, turns)
    face = np.array([0, 0, 2.125 - 60 * (2.125 + 0.4) / 20_410])
    np.testing.assert_allclose(np.linalg.norm(tools - face, axis=1).max(), 11.3, atol=1e-9)
    # The same from the shoulder's pitch axis, which the rolls and yaws before it leave where it is.
    still = tools[turns[:, 1] == 0]
    pitch = face + np.array([0, 0, 1.6])
    np.testing.assert_allclose(np.linalg.norm(still - pitch, axis=1).max(), 9.7, atol=1e-9)
    assert not np.isfinite(robot.limits.torque).any()


def test_era_is_the_same_from_either_end(robots):
    """ESA: both ends act as hand or as base. The chain read backwards has the same masses, gaps and axes."""
    description = describe_robot("era_7dof")
    arm, joints = description.links[1:], description.joints[1:]
    tool = description.end_effectors[0].position
    # What points up before the elbow points ahead after it.
    turned = np.array([[0, 0, 1], [0, 1, 0], [1, 0, 0]])
    np.testing.assert_array_equal([link.mass for link in arm], [link.mass for link in arm[::-1]])
    gaps = np.array([*(joint.position for joint in joints), tool])
    np.testing.assert_array_equal(gaps, gaps[::-1] @ turned)
    axes = np.array([joint.axis for joint in joints])
    np.testing.assert_array_equal(axes, axes[::-1] @ turned)
    for gap, link, other in zip(gaps, arm, arm[::-1], strict=True):
        np.testing.assert_allclose(link.com, 0.5 * gap)
        np.testing.assert_allclose(link.inertia, turned @ other.inertia @ turned)


def test_era_limbs_are_a_tube_between_two_drives(robots):
    """The solids that the notes name, summed grain by grain on rings along the limb instead of by formula."""
    robot = robots["era_7dof"]
    at = (np.arange(4000) + 0.5) / 4000
    disc = 0.15 * np.sqrt(at)  # radii that share a disc's area evenly
    stations = np.concatenate([0.4 * at, 4.05 * at, 4.05 - 0.4 * at])
    squares = np.repeat([np.mean(disc**2), 0.125**2, np.mean(disc**2)], 4000)
    grain = np.repeat([50.0, 65.0, 50.0], 4000) / 4000
    middle = grain @ stations / 165
    across = grain @ (0.5 * squares + (stations - middle) ** 2)
    body = robot.body_names.index("limb2")
    np.testing.assert_allclose(robot.link_com[body - 1], [middle, 0, 0], atol=1e-9)
    np.testing.assert_allclose(np.diag(robot.inertia[body]), [grain @ squares, across, across], rtol=1e-6)


def test_vispa_stands_straight_up_at_zero(robots):
    robot = robots["vispa_6dof"]
    np.testing.assert_allclose(robot.mass.sum() - 200, 0.627 + 2.328 + 3.995 + 2.328 + 3.157 + 2.695 + 0.924)
    tool, turn, _ = poses(robot, np.zeros(6))
    height = 0.508 + 0.18 + 0.8 + 0.65 + 0.325
    # The base's centre of mass lies a little up, towards the foot.
    np.testing.assert_allclose(tool[0], [0, 0, height - 0.627 * 0.508 / 200.627], atol=1e-9)
    np.testing.assert_allclose(turn.apply([0, 0, 1])[0], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(robot.limits.velocity, 0.09395689)


def test_li_turns_its_tool_at_zero_as_its_source_says(robots):
    robot = robots["li_2022_7dof"]
    _, turn, _ = poses(robot, np.zeros(7))
    stated = Rotation.from_euler("ZYX", [np.pi / 2, np.pi / 2, 0.0])
    assert (stated.inv() * turn[0]).magnitude() < 1e-12
    np.testing.assert_allclose(robot.mass.sum(), 1474.1 + 39.618 + 3 * 13.427 + 22.757 + 42.614 + 8.269)


def test_astrobee_grips_between_its_finger_tips(robots):
    robot = robots["astrobee_2dof"]
    tips = 2 * 0.04 + 0.0116026396896178 + 0.02285
    np.testing.assert_allclose(robot.mass.sum(), 9.0877 + 0.3078 + 0.1623 + 0.1033 + tips)
    bend, straight = np.deg2rad(30), np.deg2rad(30 - 55)
    tip = -np.array([0.039 + 0.05 * np.cos(bend) + 0.05 * np.cos(straight), 0.0])
    np.testing.assert_allclose(robot.end_effector_position[0][:2], tip, atol=2e-3)
    # Left and right mirror each other: nothing but the tips' masses moves the centre of mass aside.
    assert abs(robot.link_com[1][1]) < 2e-3
    np.testing.assert_allclose(robot.limits.position_lower, [-2.0944, -1.57079])


def test_servicer_shapes_have_the_volume_ratio_of_their_masses(robots):
    """Shapes and masses come from one list of uniform solids: the bodies' middles must agree with it."""
    robot = robots["servicer_7dof"]
    for body in ("link3", "link5"):
        tube, housing = robot.geometry.on_body(body)
        masses = {"link3": (10, 5), "link5": (8, 4)}[body]
        middle = (masses[0] * tube.position + masses[1] * housing.position) / sum(masses)
        com = robot.link_com[robot.body_names.index(body) - 1]
        np.testing.assert_allclose(middle, com, atol=6e-4)
