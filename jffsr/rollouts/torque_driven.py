"""Motion under joint torques: the equations of motion integrated, nothing prescribed but the torque."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.dynamics.base_mode import FLOATING, base_freedom
from jffsr.dynamics.equations_of_motion import forward_dynamics
from jffsr.dynamics.kinematics import kinematics
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.rollout import check_steps
from jffsr.rollouts.torque_step import filled_state, runge_kutta_step, state_slope
from jffsr.types import Array, Scalar, Vector

Torque = Callable[[Scalar, State], Vector]
"""Joint torques (n,), N m or N, at a time, s, in a state."""


@register_dataclass
@dataclass(frozen=True)
class DrivenMotion:
    """A motion under joint torques on N + 1 samples.

    time (N + 1,), s; base_position (N + 1, 3), m, and base_quaternion (N + 1, 4), B to I; base_twist
    (N + 1, 6), [linear; angular] in I; joint_position and joint_velocity (N + 1, n), rad or m, per s;
    joint_torque (N + 1, n), N m or N, at the samples. base_mode, static, says how the base was held.
    """

    time: Array
    base_position: Array
    base_quaternion: Array
    base_twist: Array
    joint_position: Array
    joint_velocity: Array
    joint_torque: Array
    base_mode: str = field(default=FLOATING, metadata={"static": True})

    @property
    def states(self) -> State:
        """The states at all samples, one State whose leaves have a leading axis (N + 1,)."""
        return State(
            self.base_position,
            self.base_quaternion,
            self.joint_position,
            self.base_twist,
            self.joint_velocity,
        )


def torque_rollout(
    robot: Robot,
    torque: Torque | None,
    initial_state: State,
    duration: Scalar | float,
    num_steps: int = 200,
    base_mode: str = FLOATING,
    hold: bool = False,
) -> DrivenMotion:
    """Motion of the robot under `torque(time, state)`, (n,), N m or N; None: no torque at all.

    Classical Runge-Kutta of order 4 with `num_steps` equal steps on [0, duration], s; the quaternion is brought
    back to unit length after each. With `hold` the torque is asked for once a step and held over it, as a
    sampled controller does; else at every stage. The initial state's velocities count, but for those of the
    base that base_mode holds, which are zero. num_steps, base_mode and hold are static. Raises InputError for
    a num_steps that is no positive whole number or an unknown base_mode.
    """
    steps, freedom = check_steps(num_steps), base_freedom(base_mode)
    n = robot.num_joints
    if torque is None:
        torque = _no_torque
    step = jnp.asarray(duration, dtype=float) / steps
    start = _initial(initial_state, n, freedom)

    def slope(time: Scalar, state: State, held: Vector) -> State:
        applied = held if hold else _asked(torque, time, state)
        kin = kinematics(robot, state)
        acceleration = forward_dynamics(
            robot, kin, state.base_twist, state.joint_velocity, applied, base_mode
        )
        return state_slope(state, acceleration)

    def advance(state: State, time: Scalar) -> tuple[State, tuple[State, Vector]]:
        now = _asked(torque, time, state)
        return runge_kutta_step(lambda t, s: slope(t, s, now), state, time, step), (state, now)

    # One step more than asked for: each reports the state that it starts from.
    times = jnp.arange(steps + 1) * step
    _, (states, torques) = jax.lax.scan(advance, start, times)
    return DrivenMotion(
        time=times,
        base_position=states.base_position,
        base_quaternion=states.base_quaternion,
        base_twist=states.base_twist,
        joint_position=states.joint_position,
        joint_velocity=states.joint_velocity,
        joint_torque=torques,
        base_mode=base_mode,
    )


def _no_torque(time: Scalar, state: State) -> Vector:
    return jnp.zeros_like(state.joint_velocity)


def _asked(torque: Torque, time: Scalar, state: State) -> Vector:
    # Whole numbers and lists are welcome; the loop needs one type throughout.
    return jnp.asarray(torque(time, state), dtype=state.joint_velocity.dtype)


def _initial(state: State, num_joints: int, freedom: int) -> State:
    """The state with its velocities filled in, all floating point, and what the base_mode holds at rest."""
    state = filled_state(state, num_joints)
    return replace(state, base_twist=jnp.where(np.arange(6) < freedom, state.base_twist, 0.0))
