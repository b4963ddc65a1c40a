"""Functions that are one program by themselves and part of the caller's where that is traced."""

from __future__ import annotations

from dataclasses import replace

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.compiling.options import one_program
from jffsr.dynamics.kinematics import kinematics
from jffsr.dynamics.momentum import generalized_jacobian
from jffsr.robots.builder import build_robot
from jffsr.robots.loading import describe_robot
from jffsr.robots.state import State


def test_traced_once_by_itself_and_inlined_elsewhere():
    traced = chex.assert_max_traces(lambda x: jnp.sin(x) + x**2, n=1)
    function = one_program(traced)
    for number in (0.5, 1.5):
        assert function(np.float64(number)) == pytest.approx(np.sin(number) + number**2, rel=1e-14)
    text = jax.jit(lambda x: 2.0 * function(x)).lower(np.float64(0.5)).as_text()
    assert text.count("func.func") == 1
    assert "stablehlo.sine" in text


def test_named_arguments_choose_the_program():
    @one_program(static_argnames="power")
    def raised(x, power=2):
        return x**power

    assert raised(3.0) == 9.0
    assert raised(3.0, power=3) == 27.0
    assert raised(3.0, 4) == 81.0


def test_kinematics_of_one_state_is_one_program():
    # An arm of a form that no other test has: what is compiled here was not before.
    whole = describe_robot("wu_2018_6dof")
    tools = tuple(replace(tool, link=whole.links[4].name) for tool in whole.end_effectors)
    links, joints = whole.links[:5], whole.joints[:4]
    robot = build_robot(replace(whole, links=links, joints=joints, end_effectors=tools, shapes=()))
    compiled = []

    def count(event, _, **names):
        if event == "/jax/core/compile/backend_compile_duration":
            compiled.append(names)

    jax.monitoring.register_event_duration_secs_listener(count)
    try:
        for angle in (0.1, 0.2):
            state = State(np.zeros(3), np.eye(4)[0], np.full(4, angle))
            jacobian = generalized_jacobian(robot, kinematics(robot, state))
    finally:
        jax.monitoring.unregister_event_duration_listener(count)
    chex.assert_shape(jacobian, (6, 4))
    assert len(compiled) == 2
