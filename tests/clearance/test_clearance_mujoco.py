"""Signed distances of solids against MuJoCo's, and against the largest gap over many directions."""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from two_solids import largest_gap, mujoco_distances, random_poses, random_shape, two_solids

EXACT = ("sphere", "capsule", "box")
KINDS = (*EXACT, "cylinder", "ellipsoid")
# MuJoCo's own iterations end here.
MUJOCO = 1e-9


@pytest.mark.parametrize("kinds", list(combinations_with_replacement(EXACT, 2)))
def test_boxes_spheres_and_capsules_are_exact(kinds):
    generator = np.random.default_rng(3)
    a, b = (random_shape(kind, generator) for kind in kinds)
    poses = random_poses(200, generator)
    ours, theirs = two_solids(a, b)(*poses)[:, 0], mujoco_distances(a, b, poses)
    apart = theirs > 0
    assert 50 < apart.sum() < 195
    np.testing.assert_allclose(ours[apart], theirs[apart], rtol=0, atol=MUJOCO)
    assert np.all(ours[~apart] <= MUJOCO)
    # MuJoCo's depth of a capsule whose axis is inside a box is no shortest way out; see the test below.
    if set(kinds) != {"capsule", "box"}:
        np.testing.assert_allclose(ours[~apart], theirs[~apart], rtol=0, atol=MUJOCO)


@pytest.mark.parametrize("as_capsule", [False, True])
@pytest.mark.parametrize("kinds", list(combinations_with_replacement(KINDS, 2)))
def test_no_more_clearance_than_there_is(kinds, as_capsule):
    generator = np.random.default_rng(4)
    a, b = (random_shape(kind, generator) for kind in kinds)
    poses = random_poses(100, generator)
    ours, theirs = two_solids(a, b, as_capsule)(*poses)[:, 0], mujoco_distances(a, b, poses)
    assert np.all(ours <= theirs + MUJOCO)


@pytest.mark.parametrize("kinds", [("capsule", "box"), ("box", "box"), ("capsule", "capsule")])
def test_overlap_is_the_shortest_way_apart(kinds):
    generator = np.random.default_rng(5)
    a, b = (random_shape(kind, generator) for kind in kinds)
    normals = generator.normal(size=(20_000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    poses = random_poses(150, generator)
    ours = two_solids(a, b)(*poses)[:, 0]
    deep = np.flatnonzero(ours < -0.1)
    assert len(deep) > 10
    for k in deep:
        sampled = largest_gap(a, b, poses.position[k], poses.rotation[k], normals)
        assert sampled <= ours[k] + 1e-12
        # 20,000 directions leave gaps of about 0.02 rad between them.
        assert ours[k] - sampled < 0.02


def test_tubes_lose_little():
    """Long cylinders, side by side and end to end, have nearly the clearance that they have."""
    generator = np.random.default_rng(6)
    a, b = (random_shape("cylinder", generator, size=np.array([0.06, 0.4])) for _ in range(2))
    poses = random_poses(300, generator)
    ours, theirs = two_solids(a, b, as_capsule=True)(*poses)[:, 0], mujoco_distances(a, b, poses)
    apart = theirs > 0.02
    lost = (theirs - ours)[apart]
    assert np.median(lost) < 1e-3
    assert lost.max() < 0.06


def test_flat_ends_of_a_cylinder_count():
    """In front of an end, off the axis, the distance is that to the end: of a sphere, and of a box's corner."""
    generator = np.random.default_rng(7)
    cylinder = random_shape("cylinder", generator, size=np.array([0.5, 0.6]))
    side, height = generator.uniform(-0.3, 0.3, (50, 2)), generator.uniform(0.7, 2.0, 50)
    rotation = Rotation.random(50, random_state=generator).as_matrix()
    place = np.einsum("kij,kj->ki", rotation, np.column_stack([side, height]))
    position = np.stack([np.zeros_like(place), place], axis=1)
    sphere = random_shape("sphere", generator, size=np.array([0.1]))
    ours = two_solids(cylinder, sphere)(position, np.stack([rotation, rotation], axis=1))[:, 0]
    np.testing.assert_allclose(ours, height - 0.7, rtol=0, atol=1e-14)
    box = random_shape("box", generator, size=np.full(3, 0.1))
    turned = Rotation.random(50, random_state=generator).as_matrix()
    ours = two_solids(cylinder, box)(position, np.stack([rotation, turned], axis=1))[:, 0]
    reach = 0.1 * np.abs(np.einsum("kij,ki->kj", turned, rotation[:, :, 2])).sum(axis=1)
    np.testing.assert_allclose(ours, height - 0.6 - reach, rtol=0, atol=1e-14)
