"""Zero-reaction manoeuvres: found and verified by MuJoCo's momentum, or a sentence that says why not."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

import jffsr
from jffsr.crosscheck.mujoco_model import to_mjspec
from jffsr.reactionless.manoeuvre import ManoeuvreCode, ManoeuvreSettings, zero_reaction_manoeuvre
from jffsr.reactionless.manoeuvre_path import SampledPath
from jffsr.reactionless.manoeuvre_space import coupling_in_base, coupling_rows, reach_of

PLANAR = jffsr.load_robot("ye_2019_planar3")
START, GOAL = np.array([0.3, -0.5, 0.7]), np.array([0.6, -0.2, 0.9])
SMALL = ManoeuvreSettings(degree=3, starts=2, iterations=40, steps=40, pieces=1)


@pytest.fixture(scope="module")
def found():
    return zero_reaction_manoeuvre(PLANAR, START, GOAL, 30.0, SMALL)


def test_the_goal_is_reached_at_rest(found):
    assert found.success, found.sentence
    path = found.path
    for time, posture in ((0.0, START), (30.0, GOAL)):
        q, qd, qdd = path(time)
        np.testing.assert_allclose(q, posture, atol=1e-8)
        np.testing.assert_allclose(qd, 0.0, atol=1e-12)
        np.testing.assert_allclose(qdd, 0.0, atol=1e-12)
    assert found.turn < 1e-6


def test_mujoco_sees_no_angular_momentum_with_the_base_still(found):
    """Rates along the path with a base that does not turn and the linear velocity that keeps the centre of mass."""
    model = to_mjspec(PLANAR).compile()
    data = mujoco.MjData(model)
    shares = np.linspace(0.05, 0.95, 19) * 30.0
    q, qd, _ = (np.asarray(x) for x in jax.jit(jax.vmap(found.path))(jnp.asarray(shares)))
    worst, largest = 0.0, 0.0
    for position, rate in zip(q, qd, strict=True):
        data.qpos[:] = np.concatenate([np.zeros(3), [1, 0, 0, 0], position])
        data.qvel[:] = np.concatenate([np.zeros(6), rate])
        mujoco.mj_forward(model, data)
        mujoco.mj_subtreeVel(model, data)
        worst = max(worst, np.abs(data.subtree_angmom[0]).max())
        single = np.abs(rate).max()
        data.qvel[6:] = [single, 0.0, 0.0]
        mujoco.mj_forward(model, data)
        mujoco.mj_subtreeVel(model, data)
        largest = max(largest, np.abs(data.subtree_angmom[0]).max())
    assert largest > 0.1
    assert worst < 1e-5 * largest


@pytest.mark.slow
def test_limits_are_looked_at(found):
    """Ranges and rates that the way does not keep; of rates, the duration that would do."""
    fastest = float(np.abs(found.path.joint_velocity).max())
    slow = replace(PLANAR, limits=jffsr.Limits.symmetric(3, velocity=0.5 * fastest))
    again = zero_reaction_manoeuvre(slow, START, GOAL, 30.0, SMALL)
    assert again.code is ManoeuvreCode.LIMITS_EXCEEDED
    assert "as fast as it may be" in again.sentence
    narrow = replace(PLANAR, limits=jffsr.Limits.symmetric(3, position=0.75))
    outside = zero_reaction_manoeuvre(narrow, START, GOAL, 30.0, SMALL)
    assert outside.code is ManoeuvreCode.LIMITS_EXCEEDED
    assert "leaves its range" in outside.sentence


@pytest.mark.slow
def test_seven_axes_in_space():
    """All joints by 2.5 to 10 deg; the base, free to turn, hardly does. Ranges are left out: the loops are wide."""
    robot = replace(jffsr.load_robot("servicer_7dof"), limits=jffsr.Limits.symmetric(7))
    start = np.deg2rad([0.0, -60.0, 0.0, 45.0, 0.0, -15.0, 0.0])
    goal = np.deg2rad([10.0, -55.0, 5.0, 52.5, -10.0, -10.0, 5.0])
    settings = ManoeuvreSettings(starts=4, steps=20, iterations=120, pieces=2)
    found = zero_reaction_manoeuvre(robot, start, goal, 120.0, settings)
    assert found.success, found.sentence
    assert found.end_error < 1e-8
    # Moved straight from one to the other, the joints turn it by some tenths of a degree.
    line = jffsr.Polynomial.between(start, goal, 120.0)
    still = jffsr.State(jnp.zeros(3), jnp.array([1.0, 0, 0, 0]), start)
    turned = jax.jit(lambda: jffsr.rollout(robot, line, still).base_quaternion[-1])()
    assert 2 * np.linalg.norm(turned[1:]) > 1e4 * found.turn


@pytest.mark.slow
def test_two_planar_joints_move_on_a_curve():
    """One rate without reaction: other postures of its curve can be reached, and no others, which is said."""
    robot = jffsr.load_robot("hu_2011_planar2")
    settings = ManoeuvreSettings(degree=1, starts=1, iterations=15, steps=12, pieces=2)
    off = zero_reaction_manoeuvre(robot, [0.3, -0.5], [-0.3, 0.9], 20.0, settings)
    assert off.code is ManoeuvreCode.ON_A_SURFACE
    assert off.path is None
    assert "surface" in off.sentence
    assert off.reach == (1, 1)


def test_brackets_of_a_planar_arm_with_three_joints_span_all():
    """Two rates without reaction, and the bracket of both: A . curl A of the coupling's row is not zero."""
    rows = coupling_rows(PLANAR, START[None])
    np.testing.assert_allclose(np.abs(rows), [[0.0, 0.0, 1.0]], atol=1e-12)
    assert reach_of(PLANAR, rows, START[None]) == (2, 3)

    slope = jax.jit(
        lambda q: (coupling_in_base(PLANAR, q)[2], jax.jacfwd(lambda q: coupling_in_base(PLANAR, q)[2])(q))
    )
    row, d = (np.asarray(x) for x in slope(jnp.asarray(START)))
    curl = np.array([d[2, 1] - d[1, 2], d[0, 2] - d[2, 0], d[1, 0] - d[0, 1]])
    assert abs(row @ curl) > 1e-2


def test_two_joints_across_each_other_cannot_move_at_all():
    """Each turns the base about an axis of its own."""
    robot = jffsr.load_robot("astrobee_2dof")
    found = zero_reaction_manoeuvre(robot, [0.1, 0.2], [0.3, 0.1], 20.0)
    assert found.code is ManoeuvreCode.NO_NULL_SPACE
    assert "none can exist" in found.sentence


def test_the_path_is_the_polynomial_through_its_samples():
    """Of degree five, and so given back as it is; it stands at its ends."""
    rng = np.random.default_rng(3)
    polynomials = [np.polynomial.Polynomial(rng.normal(size=6)) for _ in range(2)]
    samples = np.linspace(0.0, 3.0, 4)
    values = [np.stack([p.deriv(k)(samples) for p in polynomials], axis=1) for k in range(3)]
    path = SampledPath(*(jnp.asarray(x) for x in values), jnp.asarray(3.0))
    run = jax.jit(path)
    for time in (0.0, 0.4, 1.0, 2.71, 3.0):
        for k, x in enumerate(run(time)):
            np.testing.assert_allclose(x, [p.deriv(k)(time) for p in polynomials], rtol=1e-9, atol=1e-9)
    q, qd, qdd = run(5.0)
    np.testing.assert_allclose(q, values[0][-1], rtol=1e-12)
    np.testing.assert_array_equal([qd, qdd], 0.0)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"goal": [0.0, 0.0]}, "goal"),
        ({"start": [0.0, np.nan, 0.0]}, "start"),
        ({"duration": 0.0}, "duration"),
    ],
)
def test_bad_input_is_refused(change, what):
    given = {"start": START, "goal": GOAL, "duration": 10.0} | change
    with pytest.raises(jffsr.InputError, match=what):
        zero_reaction_manoeuvre(PLANAR, **given)
