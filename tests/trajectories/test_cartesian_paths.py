"""Waypoints, arcs and splines of poses: where they pass, how smooth they are, their gradients, refusals."""

from __future__ import annotations

from dataclasses import replace

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import BSpline, make_interp_spline
from scipy.spatial.transform import Rotation
from tool_differences import differenced_twists, sample

from jffsr.errors import InputError
from jffsr.trajectories.bspline import basis
from jffsr.trajectories.cartesian.arc import Arc
from jffsr.trajectories.cartesian.line import Line
from jffsr.trajectories.cartesian.pose_spline import PoseSpline, spline_through
from jffsr.trajectories.cartesian.timing import Uniform
from jffsr.trajectories.cartesian.tool_trajectory import ToolTrajectory
from jffsr.trajectories.cartesian.waypoints import Waypoints

POSES = [
    ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
    ([1.0, 0.0, 0.0], [0.5, 0.0, 0.3]),
    ([1.0, 0.8, 0.1], [0.5, -0.6, 1.0]),
    ([0.4, 0.9, 0.9], [1.4, -0.2, 1.0]),
    ([0.0, 0.0, 1.0], [1.9, 0.5, 2.0]),
]
UNIFORM = Uniform(np.array(1.0))
UNIT = [1.0, 0.0, 0.0, 0.0]
SPLINE = PoseSpline.by_control(POSES, 3, "xyz")
PATHS = {
    "waypoints": Waypoints.through(POSES, "xyz", 0.6),
    "circle": Arc.about([0.5, 0, 0], [0, 1, 2], ([1, 0, 0.3], UNIT), 4.0, "turning"),
    "three points": Arc.through(POSES[0], POSES[2][0], POSES[4], order="xyz"),
    "control poses": SPLINE,
    "through poses": PoseSpline.through(POSES, 4, "xyz"),
}


def matrices(angles):
    return Rotation.from_euler("xyz", angles).as_matrix()


def turned(quaternions):
    return Rotation.from_quat(np.asarray(quaternions), scalar_first=True).as_matrix()


def along(path, s):
    """Positions and rotation matrices at shares (N,) of the path."""
    found = sample(ToolTrajectory(path, UNIFORM), np.asarray(s))
    return np.asarray(found.position), turned(found.quaternion)


@jax.jit
@jax.value_and_grad
def loss(trajectory):
    """Something of pose and twist, at a place between knots."""
    return sum(jnp.sum(jnp.sin(x)) for x in trajectory(jnp.array(0.37))[:3])


def corner_places(path):
    lengths = np.linalg.norm(
        np.hstack([np.diff(path.positions, axis=0), path.metres_per_radian * steps(path)]), axis=1
    )
    return lengths, np.cumsum(lengths)[:-1] / np.sum(lengths)


def steps(path):
    """Rotation vectors (k - 1, 3) between neighbouring attitudes, in I."""
    r = Rotation.from_quat(path.quaternions, scalar_first=True)
    return (r[1:] * r[:-1].inv()).as_rotvec()


@pytest.mark.parametrize("name", PATHS)
def test_twist_and_acceleration_are_those_of_the_poses(name):
    """Away from the few places where the third derivative jumps, which order-eight differences would see."""
    trajectory = ToolTrajectory(PATHS[name], UNIFORM)
    times = np.array([0.11, 0.32, 0.41, 0.53, 0.64, 0.87])
    twist, acceleration = differenced_twists(trajectory, times, 0.0004)
    found = sample(trajectory, times)
    np.testing.assert_allclose(found.twist, twist, rtol=0, atol=2e-9)
    np.testing.assert_allclose(found.acceleration, acceleration, rtol=0, atol=2e-9)


@pytest.mark.parametrize("name", PATHS)
def test_twist_and_its_derivative_are_continuous(name):
    """Across every knot and blend: twists and accelerations a hair apart differ by a hair."""
    path = PATHS[name]
    s = np.linspace(0.001, 0.999, 400)
    places = corner_places(path)[1] if name == "waypoints" else np.asarray(getattr(path, "knots", s[:2]))
    s = np.concatenate([s, places[(places > 0) & (places < 1)]])
    ahead, behind = (sample(ToolTrajectory(path, UNIFORM), s + step) for step in (1e-9, -1e-9))
    np.testing.assert_allclose(ahead.twist, behind.twist, rtol=0, atol=1e-6)
    np.testing.assert_allclose(ahead.acceleration, behind.acceleration, rtol=0, atol=1e-5)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[] if name in ("waypoints", "circle") else [pytest.mark.slow])
        for name in PATHS
    ],
)
def test_gradients_are_finite_and_equal_differences(name):
    trajectory = ToolTrajectory(PATHS[name], UNIFORM)
    _, gradient = loss(trajectory)
    chex.assert_tree_all_finite(gradient)
    leaves, structure = jax.tree.flatten(trajectory)
    for i, slope in enumerate(jax.tree.leaves(gradient)):
        flat, k = np.asarray(leaves[i], dtype=float).ravel(), np.size(leaves[i]) // 2
        if not np.all(np.isfinite(flat)):
            continue
        values = []
        for step in (1e-6, -1e-6):
            moved = flat.copy()
            moved[k] += step
            parts = [*leaves[:i], moved.reshape(np.shape(leaves[i])), *leaves[i + 1 :]]
            values.append(float(loss(jax.tree.unflatten(structure, parts))[0]))
        np.testing.assert_allclose(np.ravel(slope)[k], (values[0] - values[1]) / 2e-6, rtol=0, atol=2e-8)


def test_gradients_stay_finite_without_turns_and_without_moves():
    still = [(p, POSES[0][1]) for p, _ in POSES]
    turning = [(POSES[0][0], a) for _, a in POSES]
    for poses in (still, turning):
        for path in (Waypoints.through(poses, "xyz", 0.6), PoseSpline.through(poses, 4, "xyz")):
            chex.assert_tree_all_finite(loss(ToolTrajectory(path, UNIFORM)))


def test_waypoints_are_straight_outside_corners_and_pass_them_at_the_stated_distance():
    path = PATHS["waypoints"]
    lengths, places = corner_places(path)
    reach = 0.6 * np.minimum(lengths[:-1], lengths[1:]) / 2
    total = np.sum(lengths)
    positions, attitudes = along(path, np.concatenate([[0, 1], places]))
    for i, at in ((0, 0), (1, 4)):
        np.testing.assert_allclose(positions[i], POSES[at][0], rtol=0, atol=1e-15)
        np.testing.assert_allclose(attitudes[i], matrices(POSES[at][1]), rtol=0, atol=1e-14)
    velocity = np.diff(path.positions, axis=0) / lengths[:, None]
    spin = np.linalg.norm(steps(path), axis=1) / lengths
    for i in range(3):
        beside = np.linalg.norm(positions[2 + i] - path.positions[i + 1])
        stated = 3 / 16 * reach[i] * np.linalg.norm(velocity[i + 1] - velocity[i])
        np.testing.assert_allclose(beside, stated, rtol=1e-12)
        # The nearest place may be another one, but not farther.
        near, _ = along(path, places[i] + np.linspace(-1, 1, 201) * reach[i] / total)
        assert np.min(np.linalg.norm(near - path.positions[i + 1], axis=1)) <= stated
        off = Rotation.from_matrix(attitudes[2 + i] @ matrices(POSES[i + 1][1]).T).magnitude()
        assert 0 < off <= 3 / 16 * reach[i] * (spin[i] + spin[i + 1])
    # Straight between two blends, at a place proportional to the combined length.
    ends = np.concatenate([[0], places, [1]])
    back, ahead = np.concatenate([[0], reach]) / total, np.concatenate([reach, [0]]) / total
    for i in range(4):
        s = np.linspace(ends[i] + back[i] + 1e-9, ends[i + 1] - ahead[i] - 1e-9, 5)
        share = (s - ends[i]) / (ends[i + 1] - ends[i])
        line = Line(*(x[i + k] for k in (0, 1) for x in (path.positions, path.quaternions)))
        for found, expected in zip(along(path, s), along(line, share), strict=True):
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)


def test_a_blend_radius_bounds_the_corners_and_a_pair_is_a_line():
    path = replace(PATHS["waypoints"], blend_radius=np.array(0.01))
    _, places = corner_places(path)
    positions, _ = along(path, places)
    beside = np.linalg.norm(positions - path.positions[1:-1], axis=1)
    assert np.all((beside > 0) & (beside < 3 / 16 * 0.01 * 2))
    pair, line = Waypoints.through(POSES[:2], "xyz"), Line.between(*POSES[:2], "xyz")
    s = np.linspace(0, 1, 7)
    for found, expected in zip(along(pair, s), along(line, s), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)


def test_arc_about_an_axis_is_the_turned_radius_and_attitude():
    s = np.linspace(0, 1, 9)
    centre, axis = np.array([0.5, 0, 0]), np.array([0, 1, 2]) / np.sqrt(5)
    turn = Rotation.from_rotvec(np.outer(4.0 * s, axis))
    positions, attitudes = along(PATHS["circle"], s)
    np.testing.assert_allclose(positions, centre + turn.apply([0.5, 0, 0.3]), rtol=0, atol=1e-15)
    np.testing.assert_allclose(attitudes, turn.as_matrix(), rtol=0, atol=2e-15)
    _, fixed = along(Arc.about(centre, axis, ([1, 0, 0.3], UNIT), 4.0), s)
    np.testing.assert_allclose(fixed, np.tile(np.eye(3), (9, 1, 1)), rtol=0, atol=0)


@pytest.mark.parametrize("via", [[1.0, 0.8, 0.1], [-0.1, 0.1, 0.4]])
def test_arc_through_three_points_is_a_circle_that_meets_them(via):
    """The short way round and the long one."""
    path = Arc.through(POSES[0], via, POSES[4], order="xyz")
    positions, attitudes = along(path, np.linspace(0, 1, 2001))
    for i in (0, 4):
        np.testing.assert_allclose(positions[-1 if i else 0], POSES[i][0], rtol=0, atol=1e-14)
        np.testing.assert_allclose(attitudes[-1 if i else 0], matrices(POSES[i][1]), rtol=0, atol=1e-14)
    radii = np.linalg.norm(positions - path.centre, axis=1)
    np.testing.assert_allclose(radii, np.linalg.norm(path.centre - via), rtol=1e-13)
    assert np.min(np.linalg.norm(positions - via, axis=1)) < 1e-3
    # One plane.
    np.testing.assert_allclose((positions - path.centre) @ path.axis, 0, rtol=0, atol=1e-14)


def test_spline_of_positions_is_scipys_and_of_turns_about_one_axis_too():
    """About one axis the angle is an ordinary B-spline of the control angles."""
    rng = np.random.default_rng(2)
    s = np.concatenate([np.linspace(0, 1, 23), SPLINE.knots])
    angles = np.cumsum(rng.uniform(-1.5, 1.5, 6))
    poses = [(rng.normal(size=3), [np.cos(a / 2), 0, 0, np.sin(a / 2)]) for a in angles]
    path = PoseSpline.by_control(poses, 4)
    positions, attitudes = along(path, s)
    peer = BSpline(path.knots, np.stack([p for p, _ in poses]), 4)
    np.testing.assert_allclose(positions, peer(s), rtol=0, atol=1e-14)
    expected = Rotation.from_rotvec(np.outer(BSpline(path.knots, angles, 4)(s), [0, 0, 1])).as_matrix()
    np.testing.assert_allclose(attitudes, expected, rtol=0, atol=1e-14)


def test_cumulative_spline_is_the_product_of_partial_turns():
    """Kim, Kim and Shin's eq. (4), multiplied out in SciPy over all the control poses."""
    s = np.linspace(0, 1, 11)
    controls = Rotation.from_euler("xyz", [angles for _, angles in POSES])
    functions = np.stack([BSpline(SPLINE.knots, np.eye(5)[i], 3)(s) for i in range(5)])
    expected = []
    for column in functions.T:
        attitude = controls[0]
        for i in range(1, 5):
            whole = (controls[i - 1].inv() * controls[i]).as_rotvec()
            attitude = attitude * Rotation.from_rotvec(np.sum(column[i:]) * whole)
        expected.append(attitude.as_matrix())
    np.testing.assert_allclose(along(SPLINE, s)[1], expected, rtol=0, atol=1e-14)


def test_spline_through_poses_meets_them_and_interpolates_as_scipy():
    path = PATHS["through poses"]
    positions = np.array([p for p, _ in POSES])
    angles = Rotation.from_euler("xyz", [a for _, a in POSES])
    steps = (angles[:-1].inv() * angles[1:]).magnitude()
    lengths = np.hypot(np.linalg.norm(np.diff(positions, axis=0), axis=1), steps)
    places = np.concatenate([[0], np.cumsum(lengths) / np.sum(lengths)])
    found, attitudes = along(path, places)
    np.testing.assert_allclose(found, positions, rtol=0, atol=1e-14)
    np.testing.assert_allclose(attitudes, angles.as_matrix(), rtol=0, atol=1e-13)
    s = np.linspace(0, 1, 15)
    peer = make_interp_spline(places, positions, 4, path.knots)
    np.testing.assert_allclose(along(path, s)[0], peer(s), rtol=0, atol=1e-13)


@pytest.mark.slow
def test_spline_through_poses_is_differentiable_by_them():
    positions = np.array([p for p, _ in POSES])
    quaternions = Rotation.from_euler("xyz", [a for _, a in POSES]).as_quat(scalar_first=True)

    @jax.jit
    def loss(positions, quaternions):
        position, q = spline_through(positions, quaternions, jnp.array(0.7), 3)(0.37)
        return jnp.sum(jnp.sin(position)) + jnp.sum(jnp.cos(q))

    slopes = jax.jit(jax.grad(loss, argnums=(0, 1)))(positions, quaternions)
    chex.assert_tree_all_finite(slopes)
    for which, index in ((0, (2, 1)), (0, (1, 0)), (1, (2, 3)), (1, (3, 0))):
        values = []
        for step in (1e-6, -1e-6):
            moved = [positions.copy(), quaternions.copy()]
            moved[which][index] += step
            values.append(float(loss(*moved)))
        np.testing.assert_allclose(slopes[which][index], (values[0] - values[1]) / 2e-6, rtol=0, atol=1e-8)


def test_basis_takes_traced_knots():
    knots, s = SPLINE.knots, jnp.linspace(0, 1, 9)
    for fixed, traced in zip(basis(knots, 3, s), jax.jit(basis, static_argnums=1)(knots, 3, s), strict=True):
        np.testing.assert_allclose(traced, fixed, rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Waypoints.through(POSES[:1], "xyz"), "1 waypoints are given; at least 2"),
        (lambda: Waypoints.through([POSES[0], *POSES], "xyz"), "waypoints 0 and 1 are the same pose"),
        (
            lambda: Waypoints.through(POSES, "xyz", 1.2),
            "blend_share is 1.2; it must be above 0 and at most 1",
        ),
        (lambda: Waypoints.through(POSES, "xyz", blend_radius=0), "blend_radius is 0 m"),
        (lambda: Waypoints.through(POSES, "xyz", metres_per_radian=0), "metres_per_radian is 0 m"),
        (lambda: Waypoints.through([POSES[0], ([0, 1], [0, 0, 0])], "xyz"), "waypoint 1 position is"),
        (lambda: Arc.about([0, 0, 0], [0, 0, 0], ([1, 0, 0], UNIT)), "axis is zero"),
        (
            lambda: Arc.about([0, 0, 0], [0, 0, 1], ([0, 0, 2], UNIT)),
            "lies on the axis; an arc needs a radius",
        ),
        (lambda: Arc.about([0, 0, 0], [0, 0, 1], ([1, 0, 0], UNIT), 0.0), "angle is 0 rad"),
        (
            lambda: Arc.about([0, 0, 0], [0, 0, 1], ([1, 0, 0], UNIT), attitude="turnin"),
            "attitude 'turnin' is unknown: 'fixed', 'turning' or 'to_goal' is expected; did you mean 'turning'",
        ),
        (
            lambda: Arc.about([0, 0, 0], [0, 0, 1], ([1, 0, 0], UNIT), attitude="to_goal"),
            "goal_attitude goes",
        ),
        (lambda: Arc.through(([0, 0, 0], UNIT), [1, 1, 1], ([3, 3, 3], UNIT)), "lie on one line"),
        (lambda: PoseSpline.by_control(POSES, 2, "xyz"), "degree is 2; a whole number of at least 3"),
        (lambda: PoseSpline.by_control(POSES[:3], 3, "xyz"), "3 control poses are given; at least 4"),
        (lambda: PoseSpline.through(POSES[:4] + POSES[3:], 3, "xyz"), "poses 3 and 4 are the same pose"),
    ],
)
def test_refusals(make, sentence):
    with pytest.raises(InputError, match=sentence):
        make()
