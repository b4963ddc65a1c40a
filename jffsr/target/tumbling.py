"""The motion of a free target: straight drift of the centre of mass, torque-free rotation about it.

The rotation is laid down once as a chain of Taylor series (`euler_series`), which any time can then be read off,
in batches of times and with gradients in time, state and inertia.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.robots.lumping import on_host
from jffsr.spatial.rotation import quaternion_multiply
from jffsr.target.body import Target
from jffsr.target.euler_series import LARGEST_ANGLE, rotation_series, sum_series
from jffsr.target.target_state import TargetState
from jffsr.types import Array, Scalar


@register_dataclass
@dataclass(frozen=True, eq=False)
class TargetMotion:
    """A target's motion on [0, duration], s, as Taylor series on equal steps; call it with a time.

    target; initial_state; duration (); quaternion (N, 4), T to I, at the start of each step; angular_velocity_series
    (N, k, 3) in T and turn_series (N, k, 4), coefficients in the time since then.
    """

    target: Target
    initial_state: TargetState
    duration: Array
    quaternion: Array
    angular_velocity_series: Array
    turn_series: Array

    @property
    def num_steps(self) -> int:
        """How many steps the duration has."""
        return self.quaternion.shape[-2]

    def __call__(self, time: Scalar) -> TargetState:
        """The state at `time` (), s, in [0, duration]; outside, the first or last step goes on and loses accuracy."""
        step = self.duration / self.num_steps
        place = jnp.clip(jnp.floor(time / step).astype(int), 0, self.num_steps - 1)
        since = time - place * step
        rate, turn = sum_series(self.angular_velocity_series[place], self.turn_series[place], since)
        return TargetState(
            position=self.initial_state.position + time * self.initial_state.velocity,
            velocity=jnp.asarray(self.initial_state.velocity),
            quaternion=quaternion_multiply(self.quaternion[place], turn),
            angular_velocity_T=rate,
        )


def target_motion(
    target: Target, initial_state: TargetState, duration: Scalar, num_steps: int | None = None
) -> TargetMotion:
    """The motion of a target from a state, without force or torque, over `duration` s.

    num_steps is chosen so that no step turns by more than a quarter of a radian; where the numbers are traced it must
    be given (`steps_needed`). Raises InputError for a duration that is not positive, and where the choice is too large.
    """
    numbers = on_host(jnp.asarray(duration))
    if numbers is not None and not (np.isfinite(numbers[0]) and numbers[0] > 0):
        raise InputError(f"target motion: duration is {numbers[0]:g} s; a positive number is expected")
    if num_steps is None:
        num_steps = steps_needed(target.inertia, initial_state.angular_velocity_T, duration)
    step = duration / num_steps

    inertia = jnp.asarray(target.inertia)

    def advance(carry, _):
        quaternion, rate = carry
        series = rotation_series(inertia, rate)
        rate, turn = sum_series(*series, step)
        following = quaternion_multiply(quaternion, turn)
        following = following / jnp.sqrt(jnp.sum(following * following))
        return (following, rate), (quaternion, *series)

    start = (jnp.asarray(initial_state.quaternion), jnp.asarray(initial_state.angular_velocity_T))
    _, (quaternion, rates, turns) = jax.lax.scan(advance, start, length=num_steps)
    return TargetMotion(target, initial_state, jnp.asarray(duration, rates.dtype), quaternion, rates, turns)


def state_before(target: Target, state: TargetState, seconds: float) -> TargetState:
    """Where the free target was so many seconds before: its motion with all velocities turned round."""
    back = replace(state, velocity=-state.velocity, angular_velocity_T=-state.angular_velocity_T)
    then = target_motion(target, back, seconds)(seconds)
    return replace(then, velocity=-then.velocity, angular_velocity_T=-then.angular_velocity_T)


def steps_needed(inertia: Array, angular_velocity_T: Array, duration: float) -> int:
    """Steps of a quarter of a radian over `duration` s, at the fastest rate that the momentum allows, |J w|/J_min.

    inertia (3, 3) in any unit; angular velocities (..., 3), rad/s, in its axes, of which the fastest decides.
    Raises InputError where the numbers are traced or need over a million.
    """
    numbers = on_host(inertia, angular_velocity_T, jnp.asarray(duration))
    if numbers is None:
        raise InputError("target motion: num_steps must be given where inertia, rate or duration are traced")
    inertia, rate, duration = numbers
    fastest = np.linalg.norm(rate @ inertia, axis=-1).max() / np.linalg.eigvalsh(inertia).min()
    needed = fastest * float(duration) / LARGEST_ANGLE
    if not needed <= 1e6:
        raise InputError(
            f"target motion: {fastest:.3g} rad/s over {float(duration):.3g} s need {needed:.3g} steps"
        )
    return max(1, math.ceil(needed))
