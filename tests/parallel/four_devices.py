"""Run with four virtual CPU devices: the same work on meshes of 1, 2 and 4 of them, the numbers as JSON."""

from __future__ import annotations

import json
import sys
from dataclasses import replace

import jax
import numpy as np
from jax.sharding import AxisType

import jffsr
from jffsr.optimizers import driver
from jffsr.optimizers.interface import FunctionProblem
from jffsr.optimizers.registry import Settings, build_phases

SETTINGS = Settings(
    particles=8, swarm_evaluations=24, starts=3, gradient_iterations=3, polish_iterations=2, memory=3
)


def mesh_of(devices: int):
    """A context of so many devices."""
    return jax.set_mesh(
        jax.make_mesh((devices,), ("batch",), (AxisType.Auto,), devices=jax.devices()[:devices])
    )


def valley(x):
    return ((1 - x[:-1]) ** 2 + 100 * (x[1:] - x[:-1] ** 2) ** 2).sum()


def search(resume_at: int | None = None):
    """A short hybrid run; or the same from one of its snapshots on."""
    problem = FunctionProblem(-2 * np.ones(4), 2 * np.ones(4), valley)
    snapshots = []
    outcome = driver.run(
        build_phases("hybrid", SETTINGS), problem, jax.random.key(1), chunk=2, on_chunk=snapshots.append
    )
    assert all(leaf.is_fully_replicated for snap in snapshots for leaf in jax.tree.leaves(snap.state))
    if resume_at is None:
        return outcome
    kept = snapshots[resume_at]
    state = jax.tree.map(
        lambda x: x if jax.dtypes.issubdtype(x.dtype, jax.dtypes.prng_key) else np.asarray(x), kept.state
    )
    return driver.run(
        build_phases("hybrid", SETTINGS),
        problem,
        jax.random.key(1),
        chunk=2,
        resume=replace(kept, state=state),
    )


def main() -> None:
    """Print what was found on each mesh."""
    jax.config.update("jax_enable_x64", True)
    assert jffsr.use_all_cores() == 4, "the number that the user sets wins"
    points = np.random.default_rng(0).uniform(-2, 2, (13, 4))
    gradients = jax.value_and_grad(valley)
    found = {}
    for devices in (1, 2, 4):
        with mesh_of(devices):
            found[devices] = {
                "values": jffsr.map_batch(valley, points, chunk=2).tolist(),
                "gradients": [x.tolist() for x in jffsr.map_batch(gradients, points, chunk=2)],
            }
            if devices != 2:
                outcome, resumed = search(), search(resume_at=2)
                found[devices]["search"] = [
                    outcome.best_position.tolist(),
                    np.array(outcome.history).tolist(),
                ]
                found[devices]["resumed"] = resumed.history == outcome.history
    found["devices"] = len(jffsr.map_batch(valley, np.tile(points, (4, 1))).sharding.device_set)
    json.dump(found, sys.stdout)


if __name__ == "__main__":
    main()
