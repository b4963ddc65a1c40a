"""Run with two virtual CPU devices: distances of bodies and their gradients on one and on two, as JSON."""

from __future__ import annotations

import json
import sys

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import AxisType, NamedSharding, PartitionSpec

import jffsr
from jffsr.dynamics.kinematics import kinematics
from jffsr.parallel.mapping import evaluate
from jffsr.robots.geometry import BOX, SPHERE, Geometry, Shape


def main() -> None:
    """Print, for each number of devices, values and gradients at four postures."""
    jax.config.update("jax_enable_x64", True)
    robot = jffsr.load_robot("hu_2011_planar2")
    shapes = (
        Shape("base", BOX, robot.body_names[0], np.zeros(3), np.eye(3), np.array([0.3, 0.3, 0.3])),
        Shape("end", SPHERE, robot.body_names[2], np.array([0.2, 0.0, 0.0]), np.eye(3), np.array([0.05])),
    )
    robot = robot.replace(geometry=Geometry(shapes))
    model = jffsr.ClearanceModel.create(robot)

    def nearest(model, joints):
        kin = kinematics(robot, jffsr.State(np.zeros(3), np.array([1.0, 0, 0, 0]), joints))
        return jnp.sum(model(kin.origin, kin.rotation))

    # As in a search: the model comes in from outside, and a step is a branch of a loop.
    @jax.jit
    def work(model, batch):
        def step(found, _):
            def moved(_):
                return evaluate(lambda joints: jax.value_and_grad(nearest, argnums=1)(model, joints), batch)

            return jax.lax.cond(found[0][0] > 1e3, lambda found: found, moved, found), None

        return jax.lax.scan(step, (jnp.zeros(len(batch)), jnp.zeros(batch.shape)), length=1)[0]

    batch, found = np.random.default_rng(0).uniform(-1.0, 1.0, (4, 2)), {}
    for devices in (1, 2):
        mesh = jax.make_mesh((devices,), ("batch",), (AxisType.Auto,), devices=jax.devices()[:devices])
        with jax.set_mesh(mesh):
            everywhere = jax.device_put(model, NamedSharding(mesh, PartitionSpec()))
            found[devices] = [np.asarray(part).tolist() for part in work(everywhere, batch)]
    json.dump(found, sys.stdout)


if __name__ == "__main__":
    main()
