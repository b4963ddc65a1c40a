"""The obvious way to roll out in JAX, shared by the opponents that differ only in what gives the base twist.

Everything is in the scan: the joint law, the kinematics and the solve of each stage, four stages written out one
after the other, 3-vectors and 3 x 3 matrices, a batch by vmap.
"""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp

from experiments.benchmarks.cases import Case

Twist = Callable[[jax.Array, jax.Array, jax.Array], jax.Array]
"""Joint positions (n,), rates (n,) and base quaternion (4,) to the base twist (6,) in I at zero momentum."""


def final_attitude(case: Case, twist: Twist, looped: bool = False) -> Callable[[jax.Array], jax.Array]:
    """A function of one candidate (2n,): the final base quaternion (4,).

    looped makes the four stages a loop, for a twist that takes too long to compile four times.
    """
    step, steps = case.step, case.steps

    def of(free):
        trajectory = case.trajectory.with_free(free)

        def slope(time, quaternion):
            q, qd, _ = trajectory(time)
            return quaternion_rate(quaternion, twist(q, qd, quaternion)[3:])

        def advance_looped(x, i):
            def stage(carry, numbers):
                last, total = carry
                reach, weight = numbers
                k = slope((i + reach) * step, x + reach * step * last)
                return (k, total + weight * k), None

            zero = jnp.zeros_like(x)
            numbers = (jnp.array([0.0, 0.5, 0.5, 1.0]), jnp.array([1.0, 2.0, 2.0, 1.0]) / 6)
            x = x + step * jax.lax.scan(stage, (zero, zero), numbers)[0][1]
            return x / jnp.linalg.norm(x), None

        def advance(x, i):
            time = i * step
            k1 = slope(time, x)
            k2 = slope(time + step / 2, x + step / 2 * k1)
            k3 = slope(time + step / 2, x + step / 2 * k2)
            k4 = slope(time + step, x + step * k3)
            x = x + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            return x / jnp.linalg.norm(x), None

        start = jnp.zeros(4).at[0].set(1.0)
        return jax.lax.scan(
            advance_looped if looped else advance, start, jnp.arange(steps, dtype=start.dtype)
        )[0]

    return of


def quaternion_rate(quaternion, omega):
    """Time derivative of the base quaternion (4,) under an angular velocity (3,) in I."""
    w, v = quaternion[0], quaternion[1:]
    return 0.5 * jnp.concatenate([-jnp.dot(omega, v)[None], w * omega + jnp.cross(omega, v)])


def rotation_matrix(quaternion):
    """Rotation matrix of a unit quaternion (4,)."""
    w, x, y, z = quaternion
    return jnp.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def loss(final: Callable[[jax.Array], jax.Array]) -> Callable[[jax.Array], jax.Array]:
    """What gradients are taken of: the squared vector part of the final quaternion."""
    return lambda free: jnp.sum(final(free)[1:] ** 2)
