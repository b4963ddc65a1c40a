"""What a design changes: derivatives of the base's turn by a mass and a length, through the whole motion."""

import jax
import jax.numpy as jnp
import numpy as np

import jffsr
from jffsr.compiling import jit

jax.config.update("jax_enable_x64", True)


def base_turn(design: jnp.ndarray) -> jnp.ndarray:
    """Angle, rad, that the base has turned by at the end; design: factors of base mass and of link 2's length."""
    robot = jffsr.load_robot("hu_2011_planar2")
    longer = jffsr.Design(length=jnp.array([1.0, design[1]]), mount=jnp.zeros((1, 3)))
    robot = jffsr.redesigned(robot, longer, mass_exponent=1.0)  # a longer link is heavier, too
    heavier = jnp.array([design[0], 1.0, 1.0])
    robot = robot.replace(mass=robot.mass * heavier, inertia=robot.inertia * heavier[:, None, None])
    start, goal = np.deg2rad([[90.0, 30.0], [-60.0, 90.0]])
    motion = jffsr.rollout(
        robot,
        jffsr.Polynomial.between(start, goal, duration=10.0),
        jffsr.State(np.zeros(3), np.array([1.0, 0, 0, 0]), start),
        duration=10.0,
        num_steps=60,
    )
    w, _, _, z = motion.base_quaternion[-1]
    return 2 * jnp.arctan2(z, w)


def main() -> tuple[float, np.ndarray]:
    turn, slope = jit(jax.value_and_grad(base_turn))(jnp.ones(2))
    print(f"the base turns by {np.rad2deg(turn):.2f} deg")
    for name, by in zip(("base's mass", "second link's length"), slope, strict=True):
        print(f"1 % more of the {name} changes that by {np.rad2deg(by) / 100:+.3f} deg")
    return float(turn), np.asarray(slope)


if __name__ == "__main__":
    main()
