"""A first plan: six joints move in 30 s, and the base ends as it was turned. Run it with --small for a short search."""

import sys

import jax
import numpy as np

import jffsr

jax.config.update("jax_enable_x64", True)


def main(small: bool = False) -> jffsr.Plan:
    robot = jffsr.load_robot("wu_6dof")
    limits = jffsr.Limits.symmetric(
        position=np.deg2rad(324), velocity=0.25, acceleration=0.2, num_joints=robot.num_joints
    )
    robot = robot.replace(limits=limits)
    start, goal = np.deg2rad([[175, -60, -60, 0, 210, 5], [120, -30, -95, 40, 170, 60]])
    trajectory = jffsr.SinePolynomial.between(
        start, goal, limits.position_lower, limits.position_upper, duration=30.0
    )
    index = jffsr.composite_index(robot, joint_goal=goal, excursion_limit=np.deg2rad(10))
    problem = jffsr.Problem(robot, trajectory, index, num_steps=40 if small else 100)
    plan = jffsr.solve(problem)  # a swarm, then gradients; checked at four times the steps
    print(plan.result.sentence)
    for name, term in plan.terms.items():
        print(f"{name:20} {float(term.weighted):.3g} of the {plan.cost:.3g}")
    plan.to_csv("first_plan.csv")
    return plan


if __name__ == "__main__":
    main(small="--small" in sys.argv)
