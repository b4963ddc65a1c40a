"""Computed torque with a learnt load: exact where the load is known, and soon so where it is not."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from loop_cases import POSTURE, ROBOT, START, loaded

from jffsr.compiling import jit
from jffsr.dynamics.equations_of_motion import forward_dynamics
from jffsr.dynamics.kinematics import kinematics
from jffsr.dynamics.momentum import base_twist
from jffsr.reactionless.control.errors import Gains
from jffsr.reactionless.control.learnt_load import LearntLoad
from jffsr.reactionless.estimation.adaptive import AdaptiveReactionless
from jffsr.reactionless.estimation.balance import Load
from jffsr.reactionless.estimation.excitation import SineSum
from jffsr.reactionless.estimation.parameters import LoadParameters
from jffsr.reactionless.interface import Desired, Measured
from jffsr.reactionless.plant import closed_loop
from jffsr.reactionless.plant_settings import LoopSettings

GAINS = Gains(np.full(3, 10.0), np.full(3, 1.0))
TRUE = Load(5.0, np.array([0.1, 0.0, 0.0]), 2.5 * np.eye(3))


@pytest.mark.slow
def test_with_the_true_load_the_plant_accelerates_as_wanted():
    """Our forward dynamics of the compound, to which the torque is given, shares no code with the torque's way here."""
    whole = loaded()
    rates, spin = np.array([0.3, -0.2, 0.5]), np.array([0.0, 0.0, 0.1])
    state = replace(START, base_twist=np.concatenate([np.zeros(3), spin]), joint_velocity=rates)
    measured = Measured(START.base_quaternion, spin, np.zeros(6), POSTURE, rates, jnp.array(False))
    wanted = np.array([0.4, 0.1, -0.6])
    desired = Desired(POSTURE, rates, wanted)
    controller = LearntLoad.of(ROBOT, GAINS, LoadParameters(guess=TRUE))
    _, torque = jit(controller.advance)(controller.begin(measured), 0.0, measured, desired)
    kin = kinematics(whole, state)
    found = forward_dynamics(whole, kin, state.base_twist, rates, torque)
    # A sample that is not fresh leaves the guess as it is.
    np.testing.assert_allclose(found[6:], wanted, atol=1e-9)


@pytest.mark.slow
def test_an_unknown_load_is_held_by_what_was_learnt():
    whole = loaded()
    rates = np.array([0.1, -0.1, 0.2])
    twist = base_twist(whole, kinematics(whole, START), rates, np.array([0, 0, 0, 0, 0, 1.25]))
    start = replace(START, base_twist=np.asarray(twist), joint_velocity=rates)
    reference = AdaptiveReactionless(ROBOT, LoadParameters(), 0.01, SineSum.spread(3, 0.05))
    run = jit(closed_loop)(
        whole, start, reference, LearntLoad.of(ROBOT, GAINS), LoopSettings(1500), jax.random.key(0)
    )
    spin = np.abs(np.asarray(run.states.base_twist[:, 5]))
    assert int(run.code) == 0
    assert spin[0] > 1e-3
    assert spin[-200:].max() < 1e-2 * spin[0]
