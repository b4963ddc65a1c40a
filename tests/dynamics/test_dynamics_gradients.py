"""Gradients of the dynamics in states, masses, inertias and lengths against differences of high order."""

from __future__ import annotations

from pathlib import Path

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

from jffsr.dynamics.base_mode import ATTITUDE_HELD, FLOATING
from jffsr.dynamics.equations_of_motion import bias_force, forward_dynamics, inverse_dynamics
from jffsr.dynamics.kinematics import kinematics
from jffsr.dynamics.momentum import generalized_inertia, kinetic_energy
from jffsr.robots.loading import load_robot
from jffsr.robots.state import State

TREE = Path(__file__).parents[1] / "data" / "robots" / "tree_prismatic.yaml"
# Central differences of order 8 of a step that leaves rounding and truncation near 1e-11 each.
WEIGHTS = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
STEP = 1e-2
NUMBERS = ("mass", "inertia", "link_com", "joint_position")


# What a fixed base computes, the other two compute as well.
@pytest.fixture(scope="module", params=[FLOATING, pytest.param(ATTITUDE_HELD, marks=pytest.mark.slow)])
def differentiated(request):
    """Directional derivatives by jvp, by vjp and by differences, along 12 directions of everything at once."""
    mode = request.param
    rng = np.random.default_rng(3)
    robot = load_robot(TREE)
    n = robot.num_joints
    quaternion = rng.normal(size=4)
    inputs = {
        "state": State(rng.normal(size=3), quaternion / np.linalg.norm(quaternion), rng.normal(size=n)),
        "twist": rng.normal(size=6),
        "rate": rng.normal(size=n),
        "drive": rng.normal(size=n),
        **{name: np.asarray(getattr(robot, name)) for name in NUMBERS},
    }
    flat, unravel = ravel_pytree(inputs)

    def evaluate(flat):
        x = unravel(flat)
        changed = robot.replace(**{name: x[name] for name in NUMBERS})
        state = x["state"]
        length = jnp.linalg.norm(state.base_quaternion)
        state = State(state.base_position, state.base_quaternion / length, state.joint_position)
        kin = kinematics(changed, state)
        velocities = x["twist"], x["rate"]
        return {
            "forward": forward_dynamics(changed, kin, *velocities, x["drive"], mode),
            "inverse": jnp.concatenate(inverse_dynamics(changed, kin, *velocities, x["drive"], mode)),
            "bias": bias_force(changed, kin, *velocities),
            "inertia": generalized_inertia(changed, kin, mode).ravel(),
            "energy": kinetic_energy(changed, kin, *velocities)[None],
        }

    directions = rng.normal(size=(12, flat.size)) * np.maximum(np.abs(flat), 0.1) * 0.2

    @jax.jit
    def along(direction):
        def moved(h):
            return ravel_pytree(evaluate(flat + h * direction))[0]

        forward = jax.jvp(moved, (0.0,), (1.0,))[1]
        value, pull = jax.vjp(evaluate, flat)
        rows, shape = ravel_pytree(value)
        backward = jax.lax.map(lambda row: pull(shape(row))[0] @ direction, jnp.eye(rows.size))
        steps = STEP * np.arange(1, 5)
        values = jax.lax.map(moved, jnp.concatenate([steps, -steps]))
        difference = WEIGHTS @ (values[:4] - values[4:]) / STEP
        return forward, backward, difference

    shapes = jax.eval_shape(evaluate, flat)
    _, name_of = ravel_pytree(jax.tree.map(lambda x: np.zeros(x.shape), shapes))
    return [tuple(name_of(np.asarray(x)) for x in along(direction)) for direction in directions]


@pytest.mark.parametrize("quantity", ["forward", "inverse", "bias", "inertia", "energy"])
def test_gradients_are_the_differences(differentiated, quantity):
    for forward, backward, difference in differentiated:
        chex.assert_tree_all_finite((forward, backward))
        size = np.linalg.norm(difference[quantity])
        assert size > 1e-3
        np.testing.assert_allclose(forward[quantity], difference[quantity], rtol=0, atol=2e-8 * size)
        np.testing.assert_allclose(backward[quantity], forward[quantity], rtol=0, atol=1e-11 * size)
