"""What goes wrong after a capture: little torque, a load ten times heavier, delay, measurements lost for 2 s."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from loop_cases import POSTURE, ROBOT, START, loaded, waves

from jffsr.compiling import jit
from jffsr.reactionless.control.errors import Gains
from jffsr.reactionless.control.extreme_learning import ExtremeLearning, random_machine
from jffsr.reactionless.control.passivity import PassivityBased
from jffsr.reactionless.plant import closed_loop
from jffsr.reactionless.plant_run import LoopCode
from jffsr.reactionless.plant_settings import JointDisturbance, LoopSettings, Sensors

SAMPLES = 700
DELAY = 2


def floats(tree):
    return jax.tree.map(lambda x: jnp.asarray(x, dtype=float), tree)


@pytest.fixture(scope="module")
def run():
    """The published disturbance on a swinging arm; one program for each kind of controller and delay."""

    @jit
    def program(robot, controller, settings):
        return closed_loop(robot, START, waves(SAMPLES), controller, settings, jax.random.key(0))

    def call(controller, robot=None, delay=0, **changes):
        settings = LoopSettings(SAMPLES, delay=delay, disturbance=JointDisturbance.published())
        settings = replace(settings, **{"torque_limit": np.full(3, np.inf), **changes})
        return program(loaded() if robot is None else robot, floats(controller), floats(settings))

    return call


@pytest.fixture(scope="module")
def machine():
    return ExtremeLearning.of(ROBOT, POSTURE, random_machine(jax.random.key(0)))


def feedback_alone(machine):
    """The PD as a machine that does not learn, so that no other program is compiled."""
    return replace(machine, rate=0.0, bound=0.0)


def rms(run, start=0):
    return float(np.sqrt(np.mean(np.asarray(run.error)[start:] ** 2)))


def test_what_is_learnt_takes_the_disturbance_away(run, machine):
    pd = run(feedback_alone(machine))
    learnt = run(machine)
    assert int(learnt.code) == LoopCode.KEPT
    assert rms(learnt, 300) < 0.3 * rms(pd, 300)
    assert float(jnp.abs(learnt.momentum).max()) < 1e-8


def test_a_load_ten_times_heavier_is_carried(run, machine):
    heavy = run(machine, loaded(50.0, 25.0))
    assert int(heavy.code) == LoopCode.KEPT
    assert rms(heavy) < 2 * rms(run(machine))


def test_little_torque_is_told(run, machine):
    """The disturbance alone asks for up to 1.5 N m."""
    tight = run(machine, torque_limit=np.full(3, 2.0))
    assert int(tight.code) == LoopCode.TORQUE_LIMITED
    assert float(jnp.abs(tight.torque).max()) == 2.0
    assert rms(tight) < 1.5 * rms(run(machine))
    starved = run(machine, torque_limit=np.full(3, 0.5))
    assert int(starved.code) == LoopCode.SATURATED
    assert "more torque" in starved.sentence


def test_two_seconds_without_measurements_are_survived(run, machine):
    lost = run(machine, sensors=Sensors(lost_from=2.0, lost_until=4.0))
    assert np.count_nonzero(~np.asarray(lost.fresh)) == 200
    assert int(lost.code) == LoopCode.KEPT
    error = np.abs(np.asarray(lost.error)).max(axis=1)
    assert error[400] > 0.3
    assert error[-1] < 0.1
    # So little torque brings it back as well, and that it was short of it is told.
    bounded = run(machine, sensors=Sensors(lost_from=2.0, lost_until=4.0), torque_limit=np.full(3, 20.0))
    assert int(bounded.code) in (LoopCode.TORQUE_LIMITED, LoopCode.SATURATED)


def test_delay_is_unstable_with_the_published_gains_and_stable_with_slow_ones(run, machine):
    gains = Gains.published(3)
    late = run(feedback_alone(machine), delay=DELAY)
    assert int(late.code) in (LoopCode.DIVERGED, LoopCode.NOT_FINITE)
    slow = Gains(gains.rate / 4, gains.slope)
    late = run(replace(feedback_alone(machine), gains=slow), delay=DELAY)
    assert int(late.code) == LoopCode.KEPT
    assert float(jnp.abs(late.states.joint_velocity).max()) < 1.0


@pytest.mark.slow
def test_the_adaptive_law_under_the_same_faults(run):
    law = PassivityBased.of(ROBOT)
    usual = run(law)
    assert int(usual.code) == LoopCode.KEPT
    heavy = run(law, loaded(50.0, 25.0))
    assert int(heavy.code) == LoopCode.KEPT
    assert rms(heavy) < 2 * rms(usual)
    assert int(run(law, torque_limit=np.full(3, 0.5)).code) == LoopCode.SATURATED
    assert int(run(law, delay=DELAY).code) in (LoopCode.DIVERGED, LoopCode.NOT_FINITE)
    lost = run(law, sensors=Sensors(lost_from=2.0, lost_until=4.0))
    assert int(lost.code) == LoopCode.DIVERGED
