"""PD, an extreme learning machine that learns what disturbs each joint, and a robust term.

Ye, Dong and Hong 2019, equations (30) to (35) and (47): one hidden layer whose input weights stay as they are, whose
output weights follow the error.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp

from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.reactionless.control.errors import Gains, decoupled_inertia, tracking_errors
from jffsr.reactionless.interface import Desired, Measured
from jffsr.robots.robot import Robot
from jffsr.types import Array, Scalar, Vector

INPUTS = 5
"""Of a joint's machine: desired acceleration, rate and position, e and e_dot."""
HIDDEN = 60


@register_dataclass
@dataclass(frozen=True)
class ExtremeLearning:
    """tau = M (K r + h beta + E sign(r)), d beta/dt = mu h r, h = sigmoid(A x + b), for each joint.

    inertia (n,) is M_ii; weights (l, 5), A, and bias (l,), b, are the same for all joints, beta (n, l) is each joint's
    own; rate mu; bound E, rad/s^2 or m/s^2; period, s, of the control. width, rad/s or m/s, above zero puts r/width cut
    to [-1, 1] in place of the sign, which chatters at a finite sampling rate. mu times the sum of h^2 is an integral
    gain: where its inputs hardly change the machine is an integrator of r.
    """

    inertia: Array
    gains: Gains
    weights: Array
    bias: Array
    rate: Array | float = 1.0
    bound: Array | float = 1.0
    width: Array | float = 0.0
    period: Array | float = 0.01

    @classmethod
    def of(
        cls,
        robot: Robot,
        joint_position: Vector,
        free: Vector,
        gains: Gains | None = None,
        **options: Array | float,
    ) -> ExtremeLearning:
        """For the robot without load about a posture, with input weights from `machine_weights(free)`."""
        gains = Gains.fitting(robot, gains)
        weights, bias = machine_weights(free)
        return cls(decoupled_inertia(robot, joint_position), gains, weights, bias, **options)

    def begin(self, measured: Measured) -> Array:
        """Output weights beta (n, l), zero."""
        return jnp.zeros((self.inertia.shape[0], self.bias.shape[0]))

    def advance(
        self, state: Array, time: Scalar, measured: Measured, desired: Desired
    ) -> tuple[Array, Vector]:
        """Output weights after the sample, and torques (n,)."""
        errors = tracking_errors(measured, desired, self.gains.slope)
        r = errors.combined
        hidden = self.hidden(desired, errors.error, errors.error_rate)
        learnt = jnp.sum(hidden * state, axis=1)
        smooth = jnp.clip(r / jnp.where(self.width > 0, self.width, 1.0), -1.0, 1.0)
        robust = self.bound * jnp.where(self.width > 0, smooth, jnp.sign(r))
        torque = self.inertia * (self.gains.rate * r + learnt + robust)
        return state + self.period * self.rate * hidden * r[:, None], torque

    def hidden(self, desired: Desired, error: Vector, error_rate: Vector) -> Array:
        """Hidden layer (n, l), equation (31)."""
        motion = (desired.joint_acceleration, desired.joint_velocity, desired.joint_position)
        inputs = jnp.stack([*motion, error, error_rate], axis=1)
        return jax.nn.sigmoid(inputs @ jnp.asarray(self.weights).T + self.bias)


def machine_weights(free: Vector) -> tuple[Array, Array]:
    """Input weights A (l, 5) and biases b (l,) of free numbers (6 l,): first A row by row, then b."""
    free = jnp.asarray(free)
    if free.ndim != 1 or free.shape[0] == 0 or free.shape[0] % (INPUTS + 1):
        raise InputError(
            f"the machine's free numbers have shape {free.shape}; a row of a multiple of {INPUTS + 1} is expected"
        )
    nodes = free.shape[0] // (INPUTS + 1)
    return free[: nodes * INPUTS].reshape(nodes, INPUTS), free[nodes * INPUTS :]


def random_machine(key: Array, nodes: int = HIDDEN) -> Array:
    """Free numbers (6 nodes,) uniform in [0, 1), as the paper's plain machine has them."""
    if nodes < 1:
        raise InputError(f"nodes is {nodes}; at least one is expected")
    return jax.random.uniform(key, (nodes * (INPUTS + 1),))
