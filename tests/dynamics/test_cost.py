"""What the dynamics costs: operations counted by the compiler, in proportion to the number of joints."""

from __future__ import annotations

import jax
import numpy as np
import pytest

from jffsr.dynamics.equations_of_motion import bias_force, forward_dynamics, inverse_dynamics
from jffsr.dynamics.kinematics import kinematics
from jffsr.dynamics.momentum import kinetic_energy, momentum
from jffsr.robots.robot import REVOLUTE, Limits, Robot, Topology
from jffsr.robots.state import State


def _chain(n: int) -> Robot:
    topology = Topology(
        name="chain",
        parents=tuple(range(n)),
        joint_types=(REVOLUTE,) * n,
        joint_names=tuple(f"joint{i}" for i in range(n)),
        body_names=tuple(f"body{i}" for i in range(n + 1)),
        end_effector_names=(),
        end_effector_bodies=(),
    )
    return Robot(
        mass=np.ones(n + 1),
        inertia=np.tile(np.eye(3), (n + 1, 1, 1)),
        link_com=np.full((n, 3), 0.1),
        joint_position=np.full((n, 3), 0.2),
        joint_rotation=np.tile(np.eye(3), (n, 1, 1)),
        joint_axis=np.tile([0.0, 0.0, 1.0], (n, 1)),
        end_effector_position=np.zeros((0, 3)),
        end_effector_rotation=np.zeros((0, 3, 3)),
        root_position=np.zeros(3),
        limits=Limits.symmetric(n),
        topology=topology,
    )


def _operations(function, n: int) -> float:
    """Floating-point operations of a state's kinematics and `function` for a chain of n joints."""

    def whole(robot, position, quaternion, joints, twist, rate):
        kin = kinematics(robot, State(position, quaternion, joints))
        return function(robot, kin, twist, rate)

    arguments = _chain(n), np.zeros(3), np.array([1.0, 0, 0, 0]), np.zeros(n), np.ones(6), np.ones(n)
    return jax.jit(whole).lower(*arguments).cost_analysis()["flops"]


FUNCTIONS = {
    "bias_force": bias_force,
    "inverse_dynamics": lambda *x: inverse_dynamics(*x, x[3]),
    "forward_dynamics": lambda *x: forward_dynamics(*x, x[3]),
    "kinetic_energy": kinetic_energy,
    "momentum": momentum,
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_operations_grow_in_proportion_to_the_joints(name):
    few, more, many = (_operations(FUNCTIONS[name], n) for n in (4, 12, 28))
    # Twice as many more joints cost twice as much more; what grows with the square would cost five times it.
    assert few > 100
    assert (many - more) / (more - few) == pytest.approx(2, rel=0.02)
