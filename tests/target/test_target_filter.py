"""The filter over whole sequences: consistency over random targets, bad poses, a lost track."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from experiments.filter_consistency import simulate, summarise
from jffsr.errors import InputError
from jffsr.target.body import Target
from jffsr.target.camera import Camera, observe_target, sample_times
from jffsr.target.filter import (
    FilterSettings,
    filter_target,
)
from jffsr.target.prior import TargetPrior
from jffsr.target.target_state import TargetState
from jffsr.target.tumbling import target_motion

COUNT, WINDOW = 60, 20
SETTINGS = FilterSettings(acquisition=WINDOW, lost_after=6)


@pytest.mark.slow
def test_a_few_random_targets_are_estimated_consistently():
    runs = 16
    settings = FilterSettings(acquisition=60)
    found = simulate(Camera(), settings, TargetPrior.create(), 120, runs, 5.0, 59, 1)
    found = {name: np.asarray(value) for name, value in found.items()}
    assert np.all(np.isfinite(found["nees"]))
    assert not np.any(found["lost"])
    summary = summarise(found, settings, 1.0, 59)
    # Of 60 times 57 are expected inside; those of the estimation error hang together.
    assert summary["nis_inside"] > 0.86
    assert summary["nees_inside"] > 0.7
    # 95 % are seen, 2 % of them outliers; the gate refuses 0.1 % of the others.
    assert 0.89 < found["used"].mean() < 0.96


@pytest.fixture(scope="module")
def followed():
    """Clean poses of a tumbling target, the compiled filter, and the target's motion."""
    camera = Camera(dropouts=0.0, outliers=0.0)
    target = Target.create((0.654, 0.95, 1.0), marker=((-0.05, 0.1, 0.03), (0.5, -0.5, 0.5, 0.5)))
    start = TargetState.create((2.4, 0, -0.5), (0.01, 0.02, 0), (0.6, 0.8, 0, 0), np.deg2rad([4.0, 2.0, 1.0]))
    motion = target_motion(target, start, COUNT / camera.rate)
    states = jax.vmap(motion)(sample_times(camera, COUNT))
    run = jax.jit(lambda seen: filter_target(seen, camera, TargetPrior.create(), SETTINGS))
    return observe_target(target, states, camera, jax.random.key(3)), run, states


@pytest.mark.slow
def test_outliers_are_refused_and_change_little(followed):
    seen, run, states = followed
    clean = run(seen)
    bad = [3, 11, 30, 45]
    spoiled = run(replace(seen, position=seen.position.at[jnp.array(bad)].add(0.5)))
    refused = np.flatnonzero(~np.asarray(spoiled.used)) + WINDOW
    assert set(bad[2:]) <= set(refused)
    assert np.all(np.asarray(spoiled.normalised_innovation_squared)[[10, 25]] > SETTINGS.gate)
    assert not np.any(spoiled.lost)
    # Two in the acquisition, two after it: the last estimate hardly knows.
    last = [np.asarray(x.estimate.marker_position[-1] - states.position[-1]) for x in (clean, spoiled)]
    deviation = np.asarray(spoiled.estimate.standard_deviation[-1])
    assert np.all(np.abs(last[0] - last[1]) < 1.5 * deviation[11:14])
    # Without their help the pose is less well known.
    spread = [np.asarray(x.estimate.standard_deviation)[-1] for x in (clean, spoiled)]
    assert np.all(spread[1][:3] > spread[0][:3])
    assert np.all(spread[1][11:14] > spread[0][11:14])


@pytest.mark.slow
def test_unseen_poses_leave_the_prediction_alone(followed):
    seen, run, _ = followed
    hidden = np.ones(COUNT, bool)
    hidden[40:50] = False
    # What stands where nothing was seen must not matter.
    empty = jnp.where(hidden[:, None], seen.position, 99.0)
    found = run(replace(seen, position=empty, seen=jnp.asarray(hidden)))
    assert not np.any(np.asarray(found.used)[20:30])
    assert not np.any(found.lost)
    assert np.all(np.asarray(found.refused_in_a_row)[20:30] == 0)
    spread = np.asarray(found.estimate.standard_deviation)[:, 11]
    assert np.all(np.diff(spread[19:30]) > 0)
    assert spread[35] < spread[29]


@pytest.mark.slow
def test_a_target_that_jumps_is_told_as_lost(followed):
    seen, run, _ = followed
    jumped = run(replace(seen, position=seen.position.at[40:].add(2.0)))
    assert np.array_equal(np.asarray(jumped.refused_in_a_row)[20:], np.arange(1, 21))
    assert np.array_equal(np.asarray(jumped.lost), np.arange(WINDOW, COUNT) >= 45)


def test_too_few_poses_are_refused(followed):
    seen, _, _ = followed
    few = jax.tree.map(lambda x: x[:WINDOW], seen)
    with pytest.raises(InputError, match="20 poses were measured, and the acquisition alone takes 20"):
        filter_target(few, Camera(), TargetPrior.create(), SETTINGS)


@pytest.mark.slow
@pytest.mark.parametrize("factor", [1.0, 3.0])
def test_two_hundred_random_targets_are_estimated_consistently(factor):
    """Seeds 0 to 199; at 95 % bounds a right filter too is outside at some times, which hang together."""
    runs, horizon, every = 200, 5.0, 10
    camera, settings = Camera().scaled(factor), FilterSettings()
    found = simulate(camera, settings, TargetPrior.create(), 500, runs, horizon, every, 0, factor)
    found = {name: np.asarray(value) for name, value in found.items()}
    assert np.all(np.isfinite(found["nees"]))
    summary = summarise(found, settings, factor, every)
    assert summary["lost"] == 0
    assert summary["nis_inside"] > 0.93
    assert summary["nees_inside"] > 0.9
    assert np.all((summary["nees"] > 19) & (summary["nees"] < 21.5))
    # Each error alone is as large as its deviation says.
    ratio = np.sqrt(np.mean((found["error"] / found["deviation"]) ** 2, axis=0))
    blocks = np.sqrt([np.mean(ratio[:, k] ** 2, axis=1) for k in np.split(np.arange(20), [3, 6, 11, 14, 17])])
    assert np.all((blocks > 0.85) & (blocks < 1.15))
    # Declared from the covariance alone, and right at that moment: every error of the prediction within its tolerance.
    assert summary["declared"] > 0.7
    assert summary["right"] >= 0.95
