"""The same closed loop with MuJoCo as the plant: the computer's half is ours, the motion is not."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.compiling import jit
from jffsr.crosscheck.mujoco_model import BASE_COORDINATES, BASE_VELOCITIES, branch_order, to_mjmodel
from jffsr.reactionless.interface import Controller, Reference
from jffsr.reactionless.plant import collected
from jffsr.reactionless.plant_computer import begin, decide
from jffsr.reactionless.plant_run import LoopRun
from jffsr.reactionless.plant_settings import LoopSettings, check_loop
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.torque_step import filled_state
from jffsr.spatial.rotation import quaternion_to_matrix
from jffsr.types import Array, Vector

_begin, _decide = jit(begin), jit(decide)


def closed_loop_mujoco(
    robot: Robot,
    initial_state: State,
    reference: Reference,
    controller: Controller,
    settings: LoopSettings,
    key: Array,
) -> LoopRun:
    """`closed_loop` with MuJoCo moving the robot: after the start nothing but torques, and the strike, are written.

    The same key draws the same noise and disturbance. Step by step on the host, for one run at a time; momentum is
    MuJoCo's own. Raises InputError where MuJoCo refuses the robot.
    """
    import mujoco

    check_loop(robot, initial_state, settings)
    model = to_mjmodel(robot, float(settings.period) / settings.substeps)
    data = mujoco.MjData(model)
    order = branch_order(robot.topology)
    place = np.argsort(order)
    start = filled_state(initial_state, robot.num_joints)
    _write(data, start, order)
    memory = _begin(reference, controller, settings, start, key)
    states, decisions, momenta = [], [], []
    for index in range(settings.samples):
        mujoco.mj_forward(model, data)
        state = _state(data, place)
        mujoco.mj_subtreeVel(model, data)
        linear = model.body_subtreemass[1] * data.subtree_linvel[1]
        momenta.append(np.concatenate([linear, data.subtree_angmom[1]]))
        memory, decision = _decide(reference, controller, settings, memory, jnp.asarray(index), state, key)
        states.append(state)
        decisions.append(decision)
        torque = np.asarray(decision.torque + decision.disturbance)
        for count in range(settings.substeps):
            data.ctrl[:] = torque[order]
            begun = (index * settings.substeps + count) * model.opt.timestep
            _strike(model, data, robot, settings, begun)
            mujoco.mj_step(model, data)
    stack = jax.tree.map(lambda *leaves: jnp.stack(leaves), *decisions)
    path = jax.tree.map(lambda *leaves: jnp.stack([jnp.asarray(x) for x in leaves]), *states)
    return collected(settings, path, stack, jnp.asarray(np.array(momenta)))


def _write(data, state: State, order: np.ndarray) -> None:
    rotation = np.asarray(quaternion_to_matrix(state.base_quaternion))
    twist = np.asarray(state.base_twist)
    data.qpos[:3], data.qpos[3:BASE_COORDINATES] = state.base_position, state.base_quaternion
    data.qpos[BASE_COORDINATES:] = np.asarray(state.joint_position)[order]
    # A free joint's linear velocity is resolved in I, its angular velocity in B.
    data.qvel[:3], data.qvel[3:BASE_VELOCITIES] = twist[:3], rotation.T @ twist[3:]
    data.qvel[BASE_VELOCITIES:] = np.asarray(state.joint_velocity)[order]


def _state(data, place: np.ndarray) -> State:
    rotation = data.xmat[1].reshape(3, 3)
    return State(
        data.qpos[:3].copy(),
        data.qpos[3:BASE_COORDINATES].copy(),
        data.qpos[BASE_COORDINATES:][place],
        np.concatenate([data.qvel[:3], rotation @ data.qvel[3:BASE_VELOCITIES]]),
        data.qvel[BASE_VELOCITIES:][place],
    )


def _strike(model, data, robot: Robot, settings: LoopSettings, begun: float) -> None:
    """Write the mean wrench over the next step; MuJoCo applies it at the tool, in I."""
    import mujoco

    strike = settings.strike
    if strike is None:
        return
    step = model.opt.timestep
    until = min(begun + step, float(strike.time) + float(strike.duration))
    share = min(max((until - max(begun, float(strike.time))) / step, 0.0), 1.0)
    data.qfrc_applied[:] = 0.0
    if share == 0.0:
        return
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    site = model.site(robot.end_effector_names[0]).id
    rotation = data.site_xmat[site].reshape(3, 3)
    wrench: Vector = share * np.asarray(strike.wrench, dtype=float)
    force, moment = rotation @ wrench[:3], rotation @ wrench[3:]
    body = model.site_bodyid[site]
    mujoco.mj_applyFT(model, data, force, moment, data.site_xpos[site], body, data.qfrc_applied)
