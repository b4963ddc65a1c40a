"""A controlled robot as it really moves: the whole system's forward dynamics under sampled torques."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jffsr.dynamics.equations_of_motion import forward_dynamics
from jffsr.dynamics.kinematics import Kinematics, end_effector_pose, jacobians, kinematics
from jffsr.dynamics.momentum import inertia_blocks, momentum
from jffsr.reactionless.interface import Controller, Reference
from jffsr.reactionless.plant_computer import Decision, begin, decide
from jffsr.reactionless.plant_run import LoopRun, loop_code
from jffsr.reactionless.plant_settings import LoopSettings, Strike, check_loop
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.torque_step import filled_state, runge_kutta_step, state_slope
from jffsr.spatial.rotation import quaternion_to_matrix
from jffsr.types import Array, Scalar, Vector


def closed_loop(
    robot: Robot,
    initial_state: State,
    reference: Reference,
    controller: Controller,
    settings: LoopSettings,
    key: Array,
) -> LoopRun:
    """The plant `robot` under a reference and a controller that see only what is measured, from initial_state on.

    The robot here is the truth, with its load: neither the reference nor the controller is given it. Between two
    samples torque and joint disturbance are held, and the free-floating equations of motion are integrated by
    Runge-Kutta's classical method. `key` draws noise and disturbance: one key, one run. Everything but the settings'
    static numbers may be batched by `jax.vmap`. Raises InputError for a state or settings that do not fit the robot.
    """
    check_loop(robot, initial_state, settings)
    step = settings.period / settings.substeps
    start = filled_state(initial_state, robot.num_joints)

    def move(state: State, torque: Vector, time: Scalar) -> State:
        def advance(state: State, count: Scalar) -> tuple[State, None]:
            begun = time + count * step
            share = None if settings.strike is None else overlap(settings.strike, begun, step)

            def slope(_, now: State) -> State:
                kin = kinematics(robot, now)
                acceleration = forward_dynamics(robot, kin, now.base_twist, now.joint_velocity, torque)
                if share is not None:
                    acceleration = acceleration + share * struck(robot, kin, settings.strike)
                return state_slope(now, acceleration)

            return runge_kutta_step(slope, state, begun, step), None

        return jax.lax.scan(advance, state, jnp.arange(settings.substeps))[0]

    def sample(carry, index: Scalar):
        memory, state = carry
        memory, decision = decide(reference, controller, settings, memory, index, state, key)
        following = move(state, decision.torque + decision.disturbance, index * settings.period)
        total = momentum(robot, kinematics(robot, state), state.base_twist, state.joint_velocity)
        return (memory, following), (state, decision, total)

    first = begin(reference, controller, settings, start, key)
    _, (states, decisions, total) = jax.lax.scan(sample, (first, start), jnp.arange(settings.samples))
    return collected(settings, states, decisions, total)


def collected(settings: LoopSettings, states: State, decisions: Decision, total: Array) -> LoopRun:
    """The run of samples stacked along a leading axis, with its code."""
    error = states.joint_position - decisions.desired.joint_position
    return LoopRun(
        time=jnp.arange(settings.samples) * settings.period,
        states=states,
        desired_position=decisions.desired.joint_position,
        desired_velocity=decisions.desired.joint_velocity,
        desired_acceleration=decisions.desired.joint_acceleration,
        asked_torque=decisions.asked,
        torque=decisions.torque,
        limited=decisions.limited,
        disturbance=decisions.disturbance,
        momentum=total,
        fresh=decisions.fresh,
        code=loop_code(settings, states, error, decisions.torque, decisions.limited),
    )


def overlap(strike: Strike, begun: Scalar, step: Scalar) -> Scalar:
    """The share of an integration step, begun at a time, s, that the strike covers: its impulse is exact so."""
    until = jnp.minimum(begun + step, strike.time + strike.duration)
    return jnp.clip((until - jnp.maximum(begun, strike.time)) / step, 0.0, 1.0)


def struck(robot: Robot, kin: Kinematics, strike: Strike) -> Vector:
    """Accelerations (6 + n,) that the wrench at the first tool adds, H^-1 J' w."""
    h_b, h_bm, h_m = inertia_blocks(robot, kin)
    j_b, j_m = jacobians(robot, kin)
    wrench = wrench_I(robot, kin, strike)
    force = jnp.concatenate([j_b.T @ wrench, j_m.T @ wrench])
    return jnp.linalg.solve(jnp.block([[h_b, h_bm], [h_bm.T, h_m]]), force)


def wrench_I(robot: Robot, kin: Kinematics, strike: Strike) -> Vector:
    """The wrench (6,) about the tool, turned into I."""
    _, quaternion = end_effector_pose(robot, kin)
    rotation = quaternion_to_matrix(quaternion)
    wrench = jnp.asarray(strike.wrench, dtype=float)
    return jnp.concatenate([rotation @ wrench[:3], rotation @ wrench[3:]])
