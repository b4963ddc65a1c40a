"""Where the search for a capture begins: a posture at the grasp, reached with the right rate and from the right side.

Of a B-spline's free control points the last three are set so that at the posture the tool moves with the grasp frame
and decelerates against its x axis: with the relative velocity zero at contact, the way the tool came is the direction
of that deceleration. The other points lie straight on the way from the start; where that way is bent, they are moved so
that the curve comes nearest to the bow.
"""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.capture.grasp_path import GraspPath
from jffsr.compiling import program
from jffsr.dynamics.kinematics import jacobians, kinematics
from jffsr.dynamics.momentum import base_twist, generalized_jacobian
from jffsr.parallel.mapping import spread
from jffsr.planning.problem import Problem
from jffsr.robots.state import State
from jffsr.spatial.rotation import quaternion_multiply, quaternion_to_matrix
from jffsr.target.grasp_frames import fixed_acceleration
from jffsr.trajectories.bspline import ClampedBSpline, basis
from jffsr.types import Array, Quaternion, Scalar, Twist, Vector, Vector3

_FIT_SAMPLES = 33

_DAMPING = 1e-6
"""Added to the squares of the generalized Jacobian, m^2 and rad^2: near a singularity rates stay finite."""


@program(static_argnums=(7,))
def capture_starts(
    problems: Problem,
    paths: GraspPath,
    joint_position: Array,
    base_position: Array,
    base_quaternion: Array,
    bow: Array,
    deceleration: Array,
    end_effector: str | None,
) -> Array:
    """Free numbers (K, s, k) of captures that end near these postures.

    problems and paths with a leading axis (K,) on every array, their trajectories clamped B-splines with a free end
    and at least three free control points; joint_position (K, s, n), base_position (K, s, 3), m, and base_quaternion
    (K, s, 4) at the grasp, bow (K, s, n) of the way there (`inverse_kinematics_floating`); deceleration (s,), m/s^2, of
    the tool relative to the grasp frame.
    """

    def one(item) -> Array:
        problem, path, *postures = item
        of_one = partial(_start, problem, path, end_effector=end_effector)
        return jax.vmap(of_one)(*postures, deceleration)

    return spread(one, (problems, paths, joint_position, base_position, base_quaternion, bow))


def _start(
    problem: Problem,
    path: GraspPath,
    q: Vector,
    place: Vector3,
    turn: Quaternion,
    bow: Vector,
    deceleration: Scalar,
    end_effector: str | None,
) -> Vector:
    law = problem.trajectory
    state = State(place, turn, q)
    duration = law.duration
    _, quaternion, twist = path.frame(duration, duration)
    target = path.target_state(duration, duration)
    slowing = jnp.zeros(6).at[:3].set(deceleration * quaternion_to_matrix(quaternion)[:, 0])
    acceleration = fixed_acceleration(path.motion.target.inertia, target, path.position_T) - slowing
    rate, second = rates_at(problem, state, twist, acceleration, end_effector)
    inner = bent(law, ending_so(law, q, rate, second), bow)
    free = jnp.clip(inner, law.lower, law.upper).ravel()
    return free if law.duration_bounds is None else jnp.append(free, duration)


def rates_at(
    problem: Problem, state: State, twist: Twist, acceleration: Twist, end_effector: str | None = None
) -> tuple[Vector, Vector]:
    """Least joint rates and accelerations (n,) with which the tool has this twist and its derivative (6,), in I."""
    robot, momentum = problem.robot, jnp.asarray(problem.momentum)
    jacobian = generalized_jacobian(robot, kinematics(robot, state), end_effector)

    def tool_twist(state: State, rate: Vector) -> tuple[Twist, Twist]:
        kin = kinematics(robot, state)
        of_base = base_twist(robot, kin, rate, momentum)
        j_b, j_m = jacobians(robot, kin, end_effector)
        return j_b @ of_base + j_m @ rate, of_base

    def least(wanted: Twist) -> Vector:
        square = jacobian @ jacobian.T + _DAMPING * jnp.eye(6)
        return jacobian.T @ jnp.linalg.solve(square, wanted)

    rate = least(twist - tool_twist(state, jnp.zeros(robot.num_joints))[0])
    of_base = tool_twist(state, rate)[1]
    spin = 0.5 * quaternion_multiply(jnp.append(0.0, of_base[3:]), state.base_quaternion)

    def along(position: Vector3, quaternion: Quaternion, q: Vector) -> Twist:
        return tool_twist(State(position, quaternion, q), rate)[0]

    point = (state.base_position, state.base_quaternion, state.joint_position)
    _, turning = jax.jvp(along, point, (of_base[:3], spin, rate))
    return rate, least(acceleration - turning)


def ending_so(law: ClampedBSpline, position: Vector, rate: Vector, acceleration: Vector) -> Array:
    """Inner control points (f, n), f >= 3, of a free end at this position, rate and acceleration, (n,) each."""
    knots, p, count = law.knots, law.degree, law.control_points.shape[0]
    first, second = 1 - knots[count - 1], 1 - knots[count - 2]
    slope, bend = rate * law.duration, acceleration * law.duration**2
    last = position
    before = last - first / p * slope
    slope_before = slope - first / (p - 1) * bend
    third = before - second / p * slope_before
    others = law.inner.shape[0] - 3
    share = jnp.arange(1, others + 1)[:, None] / (others + 1)
    way = law.start + share * (third - law.start)
    return jnp.concatenate([way, jnp.stack([third, before, last])])


def bent(law: ClampedBSpline, inner: Array, bow: Vector) -> Array:
    """Inner control points (f, n), f >= 3, of which all but the last three are moved: by least squares over the way the
    curve is moved by the bow 64 s^3 (1 - s)^3 bow, bow (n,), in rad or m."""
    others = law.inner.shape[0] - 3
    share = np.linspace(0.0, 1.0, _FIT_SAMPLES)
    fixed = law.control_points.shape[0] - law.inner.shape[0]
    moved = basis(law.knots, law.degree, share)[-1][fixed : fixed + others]
    factor = np.linalg.lstsq(moved.T, 64 * share**3 * (1 - share) ** 3, rcond=None)[0]
    return inner + np.append(factor, np.zeros(3))[:, None] * bow
