"""Inverse kinematics of a robot whose base gives way while the arm moves.

Where a free base ends depends on the way there, not on the joints' end alone. The way meant here is the plainest one:
all joints go straight from the start to the end by one rest-to-rest quintic law, q(t) = q_0 + (q_1 - q_0) (10 s^3 -
15 s^4 + 6 s^5), s = t/T. Along it momentum is conserved: the base's attitude is integrated, its position follows
from the system's centre of mass, which moves straight on. Under zero angular momentum T is of no account. A planned
motion to the same joint positions by another way ends with another base pose: this confirms that a pose can be had,
and is where a planner starts.

A bow b adds 64 s^3 (1 - s)^3 b, zero at both ends with its rate and acceleration, so that the joints pass b beside
the middle of that way. It turns the base by what the loop encloses, and brings poses into reach that no straight way
leads to: of the published capture's, on the package's own arm, from 0 of 256 starts straight on and 104 with bows.
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
_WAY_TOLERANCE = 1e-9  # rad or m: rounding, where a way begins or ends on a limit


def floating_inverse_kinematics(
    robot: Robot,
    position: Array,
    quaternion: Array,
    initial_state: State,
    starts: Array,
    *,
    momentum: Twist | None = None,
    duration: Scalar | float | None = None,
    largest_bow: float = 0.0,
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
    centre of mass, is zero if None; else `duration`, s, of the motion must be given. With a largest_bow, rad or m, each
    joint's way may be bent by as much, and a success keeps the joint limits on the whole way. Each start is first
    improved by `still_iterations` steps with a still base, then by `iterations` steps of which each follows the base
    along the path (this module's first lines) in `num_steps` Runge-Kutta steps, with the derivative of that whole
    motion. Under jit and vmap as well. Raises InputError as `inverse_kinematics`, and where the duration is missing.
    """
    check_request(robot, position, quaternion, starts, iterations, position_tolerance, attitude_tolerance)
    base_freedom(base_mode)
    if not largest_bow >= 0:
        raise InputError(f"inverse kinematics: largest_bow is {largest_bow}; zero or more is expected")
    if momentum is not None and duration is None:
        raise InputError(
            "inverse kinematics: with a momentum the base's pose depends on how long the motion takes; pass "
            "duration=, in seconds"
        )
    numbers = jnp.asarray([position_tolerance, attitude_tolerance, largest_bow])
    position, quaternion, starts = (jnp.asarray(x) for x in (position, quaternion, starts))
    momentum = jnp.zeros(6) if momentum is None else jnp.asarray(momentum)
    duration = jnp.asarray(1.0 if duration is None else duration)
    state = State(
        *map(
            jnp.asarray,
            (initial_state.base_position, initial_state.base_quaternion, initial_state.joint_position),
        )
    )
    steps = (int(still_iterations), int(iterations), int(num_steps), largest_bow > 0)
    return _solve(
        robot,
        position,
        quaternion,
        starts,
        state,
        momentum,
        duration,
        numbers,
        end_effector,
        base_mode,
        steps,
    )


@program(static_argnums=(8, 9, 10))
def _solve(
    robot, position, quaternion, starts, state, momentum, duration, numbers, end_effector, base_mode, steps
) -> JointSolutions:
    chain, (still, moving, num_steps, bent) = chain_to_tool(robot, end_effector), steps
    straight = jnp.zeros((robot.num_joints, int(bent)))
    count = len(chain.joints)
    bow_limit = jnp.full(count * int(bent), numbers[2])
    lower, upper = jnp.concatenate([chain.lower, -bow_limit]), jnp.concatenate([chain.upper, bow_limit])

    def path(goal: Vector, bow: Array) -> Polynomial:
        rest = jnp.zeros_like(goal)
        return Polynomial(state.joint_position, goal, rest, rest, rest, rest, duration, bow)

    def end_of(law: Polynomial) -> tuple[Vector3, Quaternion]:
        motion = rollout(robot, law, state, duration, num_steps, momentum, base_mode)
        return motion.base_position[-1], motion.base_quaternion[-1]

    # Where the base would be if the joints stood still: without momentum, where it is.
    place, turn = end_of(path(state.joint_position, straight))

    def one(item) -> JointSolutions:
        wanted, attitude, start = item
        # Joints that do not move this tool stay where the robot has them.
        start = state.joint_position.at[chain.index].set(start[chain.index])
        in_base = quaternion_to_matrix(turn).T @ (wanted - place)
        turned = quaternion_multiply(quaternion_conjugate(turn), attitude)
        q, _ = descend(chain, tuple(in_base), tuple(turned), start, still)

        def law(unknown: Vector) -> Polynomial:
            goal = q.at[chain.index].set(unknown[:count])
            return path(goal, straight.at[chain.index, 0].set(unknown[count:]) if bent else straight)

        def base_and_tool(unknown: Vector):
            base = end_of(law(unknown))
            return base, _tool(chain, *base, unknown[:count])

        def step(_, carried):
            unknown = carried[0]
            base, (at, facing), rows = _derivative(base_and_tool, unknown)
            left = (*(wanted - at), *turn_between(tuple(attitude), tuple(facing)))
            return limited_step(rows, left, unknown, lower, upper, chain.length), unknown, base, left

        unknown = jnp.concatenate([q[chain.index], bow_limit * 0])
        blank = (jnp.zeros_like(wanted), jnp.zeros_like(attitude)), (wanted[0] * 0,) * 6
        # One round more than steps, as with the still base.
        _, unknown, base, left = jax.lax.fori_loop(0, moving + 1, step, (unknown, unknown, *blank))
        found = law(unknown)
        errors = safe_norm(jnp.stack(left[:3])), safe_norm(jnp.stack(left[3:]))
        met = success(found.goal, errors, robot.limits, numbers[:2])
        if not bent:
            return JointSolutions(found.goal, *errors, met, *base)
        way = found.on_grid(jnp.linspace(0.0, 1.0, 2 * num_steps + 1) * duration)[0]
        met = met & jnp.all(way >= robot.limits.position_lower[:, None] - _WAY_TOLERANCE)
        met = met & jnp.all(way <= robot.limits.position_upper[:, None] + _WAY_TOLERANCE)
        return JointSolutions(found.goal, *errors, met, *base, found.coefficients[:, 0])

    return over_starts(one, position, quaternion, starts, chunk=CHUNK)


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
