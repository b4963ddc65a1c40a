"""A sweep in Python: durations times seeds, all plans by one compiled call over all cores."""

import sys

import jffsr

jffsr.use_all_cores()  # before JAX is first used

import jax  # noqa: E402
import numpy as np  # noqa: E402

jax.config.update("jax_enable_x64", True)


def main(small: bool = False) -> np.ndarray:
    robot = jffsr.load_robot("hu_2011_planar2")
    limits = jffsr.Limits.symmetric(position=np.deg2rad(324), velocity=0.4, acceleration=0.2, num_joints=2)
    robot = robot.replace(limits=limits)
    start, goal = np.deg2rad([[90.0, 30.0], [-60.0, 90.0]])
    index = jffsr.composite_index(robot, joint_goal=goal, attitude_change=np.deg2rad(1.0))
    durations = [10.0, 15.0, 30.0]
    seeds = range(2 if small else 20)
    problems, draws = [], []
    for duration in durations:
        trajectory = jffsr.SinePolynomial.between(
            start, goal, limits.position_lower, limits.position_upper, duration=duration
        )
        problems += [jffsr.Problem(robot, trajectory, index, num_steps=60)] * len(seeds)
        draws += seeds
    settings = jffsr.Settings(swarm_evaluations=100, gradient_iterations=10 if small else 60)
    plans = jffsr.plan_many(problems, "hybrid", settings, seeds=draws)
    costs = plans.cost.reshape(len(durations), len(seeds))
    for duration, row in zip(durations, costs, strict=True):
        print(f"{duration:4.0f} s: J {np.min(row):.3g} at best, {np.median(row):.3g} in the median")
    return costs


if __name__ == "__main__":
    main(small="--small" in sys.argv)
