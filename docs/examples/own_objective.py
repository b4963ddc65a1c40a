"""An objective of one's own: what the joints travel joins the composite index, from Python and from YAML alike."""

import sys
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

import jffsr

jax.config.update("jax_enable_x64", True)


def travel(robot, motion):
    """Largest way of a joint, rad: the function that YAML names as `call: own_objective.travel`."""
    steps = jnp.sqrt(
        jnp.diff(motion.joint_position, axis=0) ** 2 + 1e-12
    )  # no corner where a joint turns back
    return jnp.max(jnp.sum(steps, axis=0))


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Travel:
    """The same as a term: `value` is judged by, `smooth` is what gradients go down; J adds value/scale."""

    scale: float

    name = "travel"

    def value(self, robot, motion):
        return travel(robot, motion)

    def smooth(self, robot, motion, smoothing):
        return travel(robot, motion)


def main(small: bool = False) -> tuple[jffsr.Plan, jffsr.Plan]:
    robot = jffsr.load_robot("hu_2011_planar2")
    start, goal = np.deg2rad([[90.0, 30.0], [-60.0, 90.0]])
    bound = np.full(2, np.deg2rad(324))
    trajectory = jffsr.SinePolynomial.between(start, goal, -bound, bound, duration=20.0)
    settings = jffsr.Settings(swarm_evaluations=100, gradient_iterations=10 if small else 60)
    plans = []
    for extra in ((), (Travel(scale=10.0),)):
        index = jffsr.composite_index(robot, joint_goal=goal, attitude_change=0.1, extra=extra)
        problem = jffsr.Problem(robot, trajectory, index, num_steps=100)
        plans.append(jffsr.solve(problem, settings=settings))
        print(f"travel {float(travel(robot, plans[-1].motion)):.3f} rad: {plans[-1].result.sentence}")
    return tuple(plans)


if __name__ == "__main__":
    main(small="--small" in sys.argv)
