"""Inverse kinematics of a robot whose base gives way while the arm moves.

Where a free base ends depends on the way there, not on the joints' end alone. The way meant here is the plainest one:
all joints go straight from the start to the end by one rest-to-rest quintic law, q(t) = q_0 + (q_1 - q_0) (10 s^3 -
15 s^4 + 6 s^5), s = t/T. Along it momentum is conserved: the base's attitude is integrated, its position follows
from the system's centre of mass, which moves straight on. Under zero angular momentum T is of no account. A planned
motion to the same joint positions by another way ends with another base pose: this confirms that a pose can be had,
and is where a planner starts.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jffsr.capture.inverse_kinematics import (
    ITERATIONS,
    TOLERANCE,
    JointSolutions,
    check_request,
    descend,
    over_starts,
    success,
)
from jffsr.capture.inverse_kinematics_chain import Chain, chain_to_tool, tool_pose, turn_between
from jffsr.capture.inverse_kinematics_step import limited_step
from jffsr.compiling import program
from jffsr.dynamics.base_mode import FLOATING, base_freedom
from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.rollout import rollout
from jffsr.spatial.rotation import quaternion_conjugate, quaternion_multiply, quaternion_to_matrix
from jffsr.spatial.safe import safe_norm
from jffsr.trajectories.polynomial import Polynomial
from jffsr.types import Array, Quaternion, Scalar, Twist, Vector, Vector3

FLOATING_ITERATIONS = 12
NUM_STEPS = 32
CHUNK = 16


def floating_inverse_kinematics(
    robot: Robot,
    position: Array,
    quaternion: Array,
    initial_state: State,
    starts: Array,
    *,
    momentum: Twist | None = None,
    duration: Scalar | float | None = None,
    base_mode: str = FLOATING,
    end_effector: str | None = None,
    iterations: int = FLOATING_ITERATIONS,
    still_iterations: int = ITERATIONS,
    num_steps: int = NUM_STEPS,
    position_tolerance: float = TOLERANCE,
    attitude_tolerance: float = TOLERANCE,
) -> JointSolutions:
    """Joint positions that bring the tool to poses in I when the joints go there straight from the initial state.

    position (..., 3), m, and quaternion (..., 4), E to I, of the tool at the end; initial_state, base pose and joint
    positions at rest of the joints; starts (k, n) or (..., k, n), rad or m. momentum (6,), P and L about the system's
    centre of mass, is zero if None; else `duration`, s, of the motion must be given. Each start is first improved by
    `still_iterations` steps with a still base, then by `iterations` steps of which each follows the base along the
    path (this module's first lines) in `num_steps` Runge-Kutta steps, with the derivative of that whole motion. Under
    jit and vmap as well. Raises InputError as `inverse_kinematics`, and where the duration is missing.
    """
    check_request(robot, position, quaternion, starts, iterations, position_tolerance, attitude_tolerance)
    base_freedom(base_mode)
    if momentum is not None and duration is None:
        raise InputError(
            "inverse kinematics: with a momentum the base's pose depends on how long the motion takes; pass "
            "duration=, in seconds"
        )
    tolerances = jnp.asarray([position_tolerance, attitude_tolerance])
    position, quaternion, starts = (jnp.asarray(x) for x in (position, quaternion, starts))
    momentum = jnp.zeros(6) if momentum is None else jnp.asarray(momentum)
    duration = jnp.asarray(1.0 if duration is None else duration)
    state = State(
        *map(
            jnp.asarray,
            (initial_state.base_position, initial_state.base_quaternion, initial_state.joint_position),
        )
    )
    steps = (int(still_iterations), int(iterations), int(num_steps))
    return _solve(
        robot,
        position,
        quaternion,
        starts,
        state,
        momentum,
        duration,
        tolerances,
        end_effector,
        base_mode,
        steps,
    )


@program(static_argnums=(8, 9, 10))
def _solve(
    robot, position, quaternion, starts, state, momentum, duration, tolerances, end_effector, base_mode, steps
) -> JointSolutions:
    chain, (still, moving, num_steps) = chain_to_tool(robot, end_effector), steps
    # Where the base would be if the joints stood still: without momentum, where it is.
    place, turn = _end_of_path(robot, state, state.joint_position, momentum, duration, base_mode, num_steps)

    def one(item) -> JointSolutions:
        wanted, attitude, start = item
        # Joints that do not move this tool stay where the robot has them.
        start = state.joint_position.at[chain.index].set(start[chain.index])
        in_base = quaternion_to_matrix(turn).T @ (wanted - place)
        turned = quaternion_multiply(quaternion_conjugate(turn), attitude)
        q, _ = descend(chain, tuple(in_base), tuple(turned), start, still)

        def base_and_tool(joints: Vector):
            goal = q.at[chain.index].set(joints)
            base = _end_of_path(robot, state, goal, momentum, duration, base_mode, num_steps)
            return base, _tool(chain, *base, joints)

        def step(_, carried):
            joints = carried[0]
            base, (at, facing), rows = _derivative(base_and_tool, joints)
            left = (*(wanted - at), *turn_between(tuple(attitude), tuple(facing)))
            return (
                limited_step(rows, left, joints, chain.lower, chain.upper, chain.length),
                joints,
                base,
                left,
            )

        joints = q[chain.index]
        blank = (jnp.zeros_like(wanted), jnp.zeros_like(attitude)), (wanted[0] * 0,) * 6
        # One round more than steps, as with the still base.
        _, joints, base, left = jax.lax.fori_loop(0, moving + 1, step, (joints, joints, *blank))
        q = q.at[chain.index].set(joints)
        errors = safe_norm(jnp.stack(left[:3])), safe_norm(jnp.stack(left[3:]))
        return JointSolutions(q, *errors, success(q, errors, robot.limits, tolerances), *base)

    return over_starts(one, position, quaternion, starts, chunk=CHUNK)


def _end_of_path(robot, state, q, momentum, duration, base_mode, num_steps) -> tuple[Vector3, Quaternion]:
    """Base pose in I at the end of the straight quintic joint path from the state to q."""
    start, rest = state.joint_position, jnp.zeros_like(q)
    law = Polynomial(start, q, rest, rest, rest, rest, duration, jnp.zeros((robot.num_joints, 0)))
    motion = rollout(robot, law, state, duration, num_steps, momentum, base_mode)
    return motion.base_position[-1], motion.base_quaternion[-1]


def _tool(chain: Chain, place: Vector3, turn: Quaternion, joints: Vector) -> tuple[Vector3, Quaternion]:
    pose = tool_pose(chain, joints)
    at = place + quaternion_to_matrix(turn) @ jnp.stack(pose.position)
    return at, quaternion_multiply(turn, jnp.stack(pose.quaternion))


def _derivative(base_and_tool, joints: Vector):
    """Base and tool pose at the end of the path, and the rows (6 of (k,)) of the tool's twist by the joints there."""

    def by(direction: Vector):
        (base, tool), (_, moved) = jax.jvp(base_and_tool, (joints,), (direction,))
        return base, tool, moved

    base, (at, facing), (by_position, by_quaternion) = jax.vmap(by, out_axes=(None, None, 0))(
        jnp.eye(joints.shape[0])
    )
    spin = 2 * quaternion_multiply(by_quaternion, quaternion_conjugate(facing)[None])[:, 1:]
    return base, (at, facing), (*by_position.T, *spin.T)
