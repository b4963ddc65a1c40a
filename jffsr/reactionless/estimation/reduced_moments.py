"""The load's share in the momentum balance, linear in ten constants.

With mu = m M/(m + M) the reduced mass of load and robot, the load adds R I R' W + mu a x a' to the momentum, W its
angular velocity and a = l + R c the way from the robot's centre of mass to its own, l ending at the tool. Written
out,

    R J R' W + mu l x l' + l x (W x R h) + R h x l',    h = mu c,   J = I + mu (|c|^2 1 - c c'),

so that mu, h and J, constants whatever the posture, enter linearly: they are the moments of the load with its mass
reduced. Information on them can be summed up without loss, however the load is parametrised afterwards.
"""

from __future__ import annotations

import jax.numpy as jnp

from jffsr.reactionless.estimation.balance import Balance, Load
from jffsr.spatial.inertia import parallel_axis, skew
from jffsr.types import Matrix, Scalar, Vector

NUM_MOMENTS = 10


def reduced_moments(load: Load, robot_mass: Scalar) -> Vector:
    """mu, kg, h, kg m, and J_xx, J_yy, J_zz, J_xy, J_xz, J_yz, kg m^2, about the tool in E: (10,)."""
    mu = load.mass * robot_mass / (load.mass + robot_mass)
    j = load.inertia + mu * parallel_axis(load.com)
    inertia = jnp.stack([j[0, 0], j[1, 1], j[2, 2], j[0, 1], j[0, 2], j[1, 2]])
    return jnp.concatenate([mu[None], mu * load.com, inertia])


def moment_regressor(balance: Balance) -> Matrix:
    """(3, 13): own momentum d = regressor @ [reduced moments; L in I], N m s, in B."""
    rate, turned = balance.base_rate, balance.tool_rotation
    spin = rate + balance.spin_jacobian @ balance.joint_velocity
    moving = jnp.cross(rate, balance.lever) + balance.lever_jacobian @ balance.joint_velocity
    first = (skew(balance.lever) @ skew(spin) - skew(moving)) @ turned
    x, y, z = turned.T @ spin
    zero = jnp.zeros_like(x)
    second = jnp.stack(
        [
            jnp.stack([x, zero, zero, y, z, zero]),
            jnp.stack([zero, y, zero, x, zero, z]),
            jnp.stack([zero, zero, z, zero, x, y]),
        ]
    )
    load = [jnp.cross(balance.lever, moving)[:, None], first, turned @ second]
    return jnp.concatenate([-jnp.concatenate(load, axis=1), balance.rotation.T], axis=1)
