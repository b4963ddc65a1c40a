"""Derivatives of signed distances against differences, and finite where shapes touch, are parallel or concentric."""

from __future__ import annotations

from itertools import combinations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from two_solids import random_shape, two_solids

from jffsr.clearance.model import ClearanceModel
from jffsr.clearance.solids import solid_of
from jffsr.robots.robot import Topology

FEW = ("box", "capsule")
ALL = ("box", "capsule", "box", "cylinder", "sphere")


class FreeBodies:
    """Free bodies of these kinds; every pair of them is compared."""

    def __init__(self, kinds):
        self.count = count = len(kinds)
        generator = np.random.default_rng(1)
        names = tuple(f"body{k}" for k in range(count))
        # A second shape on one body, so that the nearest of several is taken; two boxes compile for long.
        solids = {k: [solid_of(random_shape(kind, generator), k, False)] for k, kind in enumerate(kinds)}
        second = "box" if count > 2 else "sphere"
        solids[1].append(solid_of(random_shape(second, generator), 1, False))
        topology = Topology("free", (), (), (), names, (), ())
        self.model = ClearanceModel.of_solids(topology, solids, list(combinations(range(count), 2)))

        def change(position, rotation, shift, turn):
            def moved(share):
                spun = rotation + share * jnp.cross(turn[:, None], rotation.swapaxes(1, 2)).swapaxes(1, 2)
                return self.model(position + share * shift, spun)

            return jax.jvp(moved, (0.0,), (1.0,))

        self.changes = jax.jit(jax.vmap(change))

    def differences(self, position, rotation, shift, turn, step):
        def moved(share):
            spun = Rotation.from_rotvec(share * turn.reshape(-1, 3)).as_matrix().reshape(rotation.shape)
            return self.model(position + share * shift, spun @ rotation)

        return (moved(step) - moved(-step)) / (2 * step)


@pytest.fixture(scope="module", params=[FEW, pytest.param(ALL, marks=pytest.mark.slow)], ids=["few", "all"])
def bodies(request) -> FreeBodies:
    return FreeBodies(request.param)


def directions(samples: int, count: int, generator: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    return generator.normal(size=(samples, count, 3)), generator.normal(size=(samples, count, 3))


def test_derivatives_are_those_of_the_distance(bodies):
    generator, count = np.random.default_rng(2), bodies.count
    position = generator.uniform(-1, 1, (400, count, 3))
    rotation = Rotation.random(400 * count, random_state=generator).as_matrix().reshape(400, count, 3, 3)
    shift, turn = directions(400, count, generator)
    value, change = bodies.changes(position, rotation, shift, turn)
    np.testing.assert_allclose(value, bodies.model(position, rotation), rtol=0, atol=1e-13)
    fine, coarse = (bodies.differences(position, rotation, shift, turn, step) for step in (1e-6, 4e-6))
    # Where two differences do not agree there is a kink between: another feature is the nearest.
    smooth = np.abs(fine - coarse) < 1e-7
    assert smooth.mean() > 0.99
    np.testing.assert_allclose(np.asarray(change)[smooth], fine[smooth], rtol=0, atol=1e-6)


def test_reverse_mode_gives_the_same():
    generator = np.random.default_rng(3)
    model = two_solids(random_shape("capsule", generator), random_shape("cylinder", generator))
    position = np.array([[0.0, 0.0, 0.0], [1.0, 0.4, -0.3]])
    rotation = Rotation.random(2, random_state=generator).as_matrix()
    gradient = jax.jit(jax.jacrev(lambda p: model(p, rotation)[0]))(position)
    steps = 1e-6 * np.eye(6).reshape(6, 2, 3)
    expected = [(model(position + x, rotation) - model(position - x, rotation))[0] / 2e-6 for x in steps]
    np.testing.assert_allclose(np.ravel(gradient), expected, rtol=0, atol=1e-7)


def special_places(count: int) -> np.ndarray:
    """All in one place; in a row along an axis; touching, nearly touching; far apart."""
    row = np.arange(count)[:, None] * np.eye(3)[[0]]
    return np.stack([0 * row, 0.3 * row, 0.6 * row[:, ::-1], row[:, [1, 0, 2]], 1e6 * row, 1e-13 * row])


def test_finite_where_bodies_are_concentric_parallel_or_far_away(bodies):
    generator, count = np.random.default_rng(4), bodies.count
    places = special_places(count)
    position = np.repeat(places, 400 // len(places) + 1, axis=0)[:400]
    quarter = Rotation.from_rotvec(np.pi / 2 * generator.integers(-1, 2, (400 * count, 3))).as_matrix()
    rotation = quarter.reshape(400, count, 3, 3)
    value, change = bodies.changes(position, rotation, *directions(400, count, generator))
    assert np.all(np.isfinite(value))
    assert np.all(np.isfinite(change))
    # No distance changes faster than the bodies' nearest points can move.
    near = np.abs(position).max(axis=(1, 2)) < 10
    assert np.abs(np.asarray(change)[near]).max() < 100


def test_depth_is_continuous(bodies):
    """Along straight ways through each other no distance jumps, whichever rule is in force."""
    generator, count = np.random.default_rng(5), bodies.count
    rotation = Rotation.random(count, random_state=generator).as_matrix()
    start, end = generator.uniform(-1, 1, (2, count, 3))
    share = np.linspace(0, 1, 20_001)[:, None, None]
    value = bodies.model(start + share * (end - start), np.broadcast_to(rotation, (20_001, count, 3, 3)))
    fastest = np.linalg.norm((end - start)[:, None] - (end - start)[None], axis=-1).max()
    steps = np.abs(np.diff(value, axis=0))
    assert value.min() < -0.1
    assert value.max() > 0.1
    # An enclosure's own bound is left over a quarter of its radius, which adds to the slope.
    assert steps.max() < 8 * fastest / 20_000
