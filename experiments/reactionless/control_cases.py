"""What the controllers are compared on: the published capture, a reactionless motion of it, and loads to train with."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

import jffsr
from jffsr.compiling import jit
from jffsr.dynamics.kinematics import kinematics, system_com
from jffsr.dynamics.momentum import inertia_blocks
from jffsr.pytrees import register_dataclass
from jffsr.reactionless.control.recorded import Recorded
from jffsr.spatial.inertia import skew
from jffsr.types import Array, Scalar, Vector

ROBOT = jffsr.load_robot("ye_2019_planar3")
START = jffsr.State(np.zeros(3), np.array([1.0, 0, 0, 0]), np.zeros(3), np.zeros(6), np.zeros(3))
PUBLISHED = np.array([5.0, 2.5, 0.1, 0.5])
"""The target's mass, kg, inertia, kg m^2, distance beyond the tool, m, and spin, rad/s."""
ZETA = 0.3 * np.ones(3)
"""Null-space rates, rad/s: the paper's direction [1, 1, 1]."""
SWING = 0.3
"""rad/s, at which they go back and forth, so that no joint winds up."""
_CUT = 1e-10


@register_dataclass
@dataclass(frozen=True)
class Case:
    """A compound right after its plastic capture, its momentum (6,), and the joint motion to follow."""

    robot: jffsr.Robot
    state: jffsr.State
    momentum: Array
    record: Recorded


def case(load: Vector, samples: int, period: Scalar | float) -> Case:
    """The case of a load (4,), as PUBLISHED has it; the motion is made with the true load, unknown to controllers."""
    mass, inertia, distance, spin = load
    target = jffsr.Target.create(inertia * jnp.ones(3), mass)
    place = jnp.stack([3.5 + distance, 0.0, 0.0])
    turning = jnp.stack([0.0, 0.0, spin])
    there = jffsr.TargetState.create(place, jnp.zeros(3), jnp.array([1.0, 0, 0, 0]), turning)
    compound = jffsr.grasped(ROBOT, START, target, there)
    record = reactionless_record(compound.robot, compound.momentum[3:], samples, period)
    return Case(compound.robot, compound.state, compound.momentum, record)


published_case = jit(lambda samples, period: case(jnp.asarray(PUBLISHED), samples, period), static_argnums=0)


def drawn_loads(seed: int, count: int, spread: float = 0.3) -> np.ndarray:
    """Loads (count, 4) about the published one, each number uniform within +-spread of it."""
    return PUBLISHED * (1 + spread * np.random.default_rng(seed).uniform(-1, 1, (count, 4)))


def reactionless_record(robot: jffsr.Robot, momentum: Vector, samples: int, period: Scalar) -> Recorded:
    """Minimum-norm rates that take up L (3,), N m s, and a null-space part: Ye, Dong and Hong 2019, equation (19).

    From the straight arm, the base still in the axes of I; Runge-Kutta over each period, accelerations as the rates'
    derivative along the motion.
    """

    def rates(time: Scalar, position: Vector) -> Vector:
        kin = kinematics(robot, jffsr.State(jnp.zeros(3), START.base_quaternion, position))
        _, h_bm, _ = inertia_blocks(robot, kin)
        lever = system_com(robot, kin) - kin.base_position
        # About the common centre of mass, where linear momentum does not enter.
        coupling = h_bm[3:] - skew(lever) @ h_bm[:3]
        inverse = jnp.linalg.pinv(coupling, rtol=_CUT)
        free = ZETA * jnp.cos(SWING * time)
        return inverse @ momentum + free - inverse @ (coupling @ free)

    def advance(position: Vector, index: Scalar):
        time = index * period
        k1 = rates(time, position)
        k2 = rates(time + period / 2, position + period / 2 * k1)
        k3 = rates(time + period / 2, position + period / 2 * k2)
        k4 = rates(time + period, position + period * k3)
        _, acceleration = jax.jvp(rates, (time, position), (jnp.ones_like(time), k1))
        return position + period / 6 * (k1 + 2 * k2 + 2 * k3 + k4), (position, k1, acceleration)

    _, motion = jax.lax.scan(advance, jnp.zeros(robot.num_joints), jnp.arange(samples))
    return Recorded(*motion)
