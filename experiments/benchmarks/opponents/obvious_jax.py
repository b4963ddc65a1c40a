"""Plain JAX as one would write it down: bodies by forward kinematics in I, a 3 x 3 solve in every stage."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from experiments.benchmarks.cases import Case
from experiments.benchmarks.opponents.integrate import Twist, rotation_matrix


def twist(case: Case) -> Twist:
    """Base twist by sums over the bodies."""
    robot, parents = case.robot, case.robot.topology.parents
    assert robot.topology.is_revolute.all()

    def of(q, qd, quaternion):
        rotations, origins = [rotation_matrix(quaternion)], [jnp.zeros(3)]
        # Position, velocity and angular velocity of every body with the base held.
        velocities, spins, coms, com_velocities = (
            [jnp.zeros(3)],
            [jnp.zeros(3)],
            [jnp.zeros(3)],
            [jnp.zeros(3)],
        )
        for i, parent in enumerate(parents):
            arm = rotations[parent] @ robot.joint_position[i]
            placed = rotations[parent] @ robot.joint_rotation[i]
            spin = spins[parent] + placed @ robot.joint_axis[i] * qd[i]
            rotation = placed @ axis_angle(robot.joint_axis[i], q[i])
            lever = rotation @ robot.link_com[i]
            rotations.append(rotation)
            origins.append(origins[parent] + arm)
            velocities.append(velocities[parent] + jnp.cross(spins[parent], arm))
            spins.append(spin)
            coms.append(origins[-1] + lever)
            com_velocities.append(velocities[-1] + jnp.cross(spin, lever))
        mass = robot.mass
        rotation, com, com_velocity = jnp.stack(rotations), jnp.stack(coms), jnp.stack(com_velocities)
        centre, drift = mass @ com / mass.sum(), mass @ com_velocity / mass.sum()
        inertia = rotation @ robot.inertia @ jnp.swapaxes(rotation, -1, -2)
        lever = com - centre
        square = (
            jnp.sum(lever**2, axis=-1)[:, None, None] * jnp.eye(3) - lever[:, :, None] * lever[:, None, :]
        )
        locked = jnp.sum(inertia + mass[:, None, None] * square, axis=0)
        momentum = jnp.sum(
            jnp.einsum("bij,bj->bi", inertia, jnp.stack(spins))
            + mass[:, None] * jnp.cross(lever, com_velocity),
            axis=0,
        )
        omega = jnp.linalg.solve(locked, -momentum)
        return jnp.concatenate([-drift - jnp.cross(omega, centre), omega])

    return of


def axis_angle(axis, angle):
    """Rotation matrix by Rodrigues' formula."""
    x, y, z = axis
    cross = jnp.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]], dtype=jnp.asarray(angle).dtype)
    return jnp.eye(3) + jnp.sin(angle) * cross + (1 - jnp.cos(angle)) * (cross @ cross)


def final_attitude(case: Case):
    """See `integrate.final_attitude`."""
    from experiments.benchmarks.opponents import integrate

    return integrate.final_attitude(case, twist(case))


def batched(function):
    """A user's batch: one vmap."""
    return jax.vmap(function)
