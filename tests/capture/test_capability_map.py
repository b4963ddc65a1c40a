"""Capability maps: a planar arm in closed form, interruption, files, the lookup, and postures found again."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jffsr
from jffsr.capture.capability_map_grid import pose_grid, within_last_joint
from jffsr.capture.capability_map_search import Searcher, clear_postures, search_poses
from jffsr.clearance.model import ClearanceModel
from jffsr.spatial.rotation import quaternion_to_matrix

CELLS, DIRECTIONS = 200, 8
JOINT_1 = np.array([0.5, 0.0])
SMALL = {"cells": CELLS, "directions": DIRECTIONS, "self_clearance": False}
BLOCK = "jffsr.capture.capability_map.BLOCK_POSES"


@pytest.fixture(scope="module")
def planar(robots):
    """Three links of 1 m in a plane, the elbow within +-120 degrees, and its map."""
    robot = robots["ye_2019_planar3"]
    bend = np.array([np.inf, np.deg2rad(120.0), np.inf])
    robot = robot.replace(limits=replace(robot.limits, position_lower=-bend, position_upper=bend))
    with pytest.MonkeyPatch.context() as patch:
        # So that small a map has several blocks.
        patch.setattr(BLOCK, 64 * DIRECTIONS)
        return robot, jffsr.capability_map(robot, **SMALL)


def wrist_distance(capability):
    """Distance (nx, ny, d), m, of the last joint from the first, for each cell and direction."""
    x, y, _ = capability.axes
    tool = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    wrist = tool[:, :, None] - np.asarray(capability.direction)[None, None, :, :2]
    return np.linalg.norm(wrist - JOINT_1, axis=-1)


def test_a_planar_arm_reaches_an_annulus_for_each_direction(planar):
    _, capability = planar
    assert capability.share.shape[2] == 1
    distance = wrist_distance(capability)
    expected = (distance <= 2.0) & (distance >= 1.0)
    clear = (np.abs(distance - 2) > 1e-3) & (np.abs(distance - 1) > 1e-3)
    found = capability.direction_share[:, :, 0]
    np.testing.assert_array_equal(found[clear], expected[clear])
    assert clear.mean() > 0.95
    assert 0.15 < expected.mean() < 0.5
    np.testing.assert_allclose(capability.share, capability.direction_share.mean(axis=-1), atol=1e-15)


def test_a_quarter_turn_about_the_first_joint_changes_nothing(planar):
    _, capability = planar
    share = capability.share[:, :, 0]
    np.testing.assert_array_equal(share, np.rot90(share))
    x, y, _ = capability.axes
    np.testing.assert_allclose([x.mean(), y.mean()], JOINT_1, atol=1e-12)


def test_repeated_and_gone_on_from_it_is_the_same(planar, tmp_path, monkeypatch):
    robot, whole = planar
    monkeypatch.setattr(BLOCK, 64 * DIRECTIONS)
    file, stopped = tmp_path / "map.part", []

    def stop(done, count):
        stopped.append((done, count))
        if len(stopped) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        jffsr.capability_map(robot, **SMALL, checkpoint=file, progress=stop)
    assert stopped[-1][0] == 128
    stopped += [None] * 2
    resumed = jffsr.capability_map(robot, **SMALL, checkpoint=file, progress=stop)
    assert stopped[4][0] == 192
    for name in ("share", "direction_share", "origin"):
        np.testing.assert_array_equal(getattr(resumed, name), getattr(whole, name))
    with pytest.raises(jffsr.InputError, match="of another map"):
        jffsr.capability_map(robot, **{**SMALL, "directions": 4}, checkpoint=file)
    file.write_bytes(file.read_bytes()[:-40])
    with pytest.raises(jffsr.InputError, match="cannot be read"):
        jffsr.capability_map(robot, **SMALL, checkpoint=file)


@pytest.mark.slow
def test_the_size_of_blocks_shows_nowhere(planar):
    """Of this arm every pose is found, from whichever starts."""
    robot, in_blocks = planar
    np.testing.assert_array_equal(jffsr.capability_map(robot, **SMALL).share, in_blocks.share)


def test_a_file_gives_the_map_back_and_tells_what_is_wrong_with_it(planar, tmp_path):
    _, capability = planar
    path = tmp_path / "map.nc"
    jffsr.save_capability_map(capability, path)
    loaded = jffsr.load_capability_map(path)
    for name in ("share", "direction_share", "origin", "direction", "spacing"):
        np.testing.assert_allclose(getattr(loaded, name), getattr(capability, name), atol=1e-12)
    assert (loaded.robot, loaded.rolls, loaded.self_clearance) == ("ye_2019_planar3", 1, False)
    jffsr.save_capability_map(replace(capability, share=0.9 * capability.share), path)
    with pytest.raises(jffsr.InputError, match="do not agree"):
        jffsr.load_capability_map(path)
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(jffsr.InputError, match="cannot be read"):
        jffsr.load_capability_map(path)
    with pytest.raises(jffsr.InputError, match="no such file"):
        jffsr.load_capability_map(tmp_path / "none.nc")


def test_the_lookup_is_linear_between_centres_zero_outside_and_differentiable():
    shape, origin, spacing = (4, 5, 6), np.array([-0.3, 0.2, 1.0]), 0.2
    index = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    slope = np.array([0.02, -0.03, 0.05])
    capability = jffsr.CapabilityMap(
        origin,
        np.asarray(spacing),
        0.4 + index @ slope,
        np.zeros((*shape, 1)),
        np.eye(3)[:1],
        "x",
        "e",
        1,
        True,
    )
    points = np.random.default_rng(0).uniform(0.01, 0.99, (20, 3)) * (np.array(shape) - 1)
    at = jax.jit(jax.vmap(jax.value_and_grad(capability.value)))
    value, gradient = at(origin + spacing * points)
    np.testing.assert_allclose(value, 0.4 + points @ slope, atol=1e-14)
    np.testing.assert_allclose(gradient, np.broadcast_to(slope / spacing, (20, 3)), atol=1e-12)
    # It fades out within a cell.
    beyond = origin + spacing * np.array([[-0.5, 2, 2], [-1.5, 2, 2], [2, 2, 5.25], [90, 0, 0]])
    edge = [0.5 * (0.4 + 2 * slope[1] + 2 * slope[2]), 0.0, 0.75 * (0.4 + index[2, 2, 5] @ slope), 0.0]
    np.testing.assert_allclose(at(beyond)[0], edge, atol=1e-14)
    assert bool(np.all(np.isfinite(at(beyond)[1])))


@pytest.mark.slow
def test_a_tool_within_the_base_is_in_contact(robots):
    robot = robots["ye_2019_planar3"]
    both = [jffsr.capability_map(robot, cells=60, directions=4, self_clearance=on) for on in (True, False)]
    x, y, _ = both[0].axes
    inside = (np.abs(x)[:, None] < 0.3) & (np.abs(y)[None] < 0.3)
    assert inside.any()
    clear, free = (capability.share[:, :, 0] for capability in both)
    assert not clear[inside].any()
    assert free[inside].all()
    assert bool(np.all(clear <= free))


def found_again(robot, clearance, count):
    """Share of the poses of random postures that the search says are reached, and whether none was ruled out."""
    _, chain = pose_grid(robot, None, 100, 4, 2)
    searcher = Searcher.create(robot, None, clearance, 0.0, 5)
    q = np.asarray(jffsr.random_starts(robot, jax.random.key(3), count))
    if clearance is not None:
        q = q[clear_postures(robot, clearance, 0.0, q)]

    def pose(joints):
        state = jffsr.State(jnp.zeros(3), jnp.array([1.0, 0.0, 0.0, 0.0]), joints)
        return jffsr.end_effector_pose(robot, jffsr.kinematics(robot, state))

    position, quaternion = map(np.asarray, jax.jit(jax.vmap(pose))(q))
    rotation = np.asarray(jax.vmap(quaternion_to_matrix)(quaternion))
    possible = [
        within_last_joint("", chain, p[None], r[None]).item() for p, r in zip(position, rotation, strict=True)
    ]
    _, reached = search_poses(searcher, position, quaternion, np.random.default_rng(0))
    return reached.mean(), all(possible)


@pytest.mark.slow
def test_poses_of_random_postures_are_found_again(robots):
    share, possible = found_again(robots["servicer_7dof"], None, 512)
    assert possible
    assert share > 0.997


@pytest.mark.slow
def test_poses_of_clear_postures_are_found_again_clear(robots):
    robot = robots["servicer_7dof"]
    share, possible = found_again(robot, ClearanceModel.create(robot), 4096)
    assert possible
    assert share > 0.99


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("ye_2019_planar3", {"cells": 0}, "cells is 0; a positive number is expected"),
        ("ye_2019_planar3", {"margin": -0.1}, "margin is -0.1 m; zero or more"),
        ("astrobee_2dof", {}, "has 2 joints; with fewer than"),
        (
            "hu_2011_planar2",
            {},
            "has 2 joints; with fewer than 3 it reaches next to none of the poses in its plane",
        ),
    ],
)
def test_what_makes_no_map_is_refused(robots, name, change, words):
    with pytest.raises(jffsr.InputError, match=words):
        jffsr.capability_map(robots[name], **{"cells": 100, "directions": 4, **change})
