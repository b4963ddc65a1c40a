"""What `attach`, `weld` and `RigidBody.create` refuse, each in one sentence."""

from __future__ import annotations

import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jffsr


@pytest.fixture(scope="module")
def arm():
    return jffsr.load_robot("wu_6dof")


@pytest.fixture(scope="module")
def bus():
    return jffsr.RigidBody.create(100.0, [10, 10, 10], name="bus")


ATTACH = {
    "an unknown link": (
        dict(link="toolbox"),
        "link: found 'toolbox', which 'bus' does not have (it has bus)",
    ),
    "an unknown word": (dict(arm_base="leave"), "arm_base is 'leave'; allowed are 'keep' and 'drop'"),
    "a position of two": (dict(position=[1, 2]), "position has shape (2,); 3 numbers are expected"),
    "a position that is none": (dict(position=[1, 2, np.nan]), "position [1.0, 2.0, nan] is not finite"),
    "a quaternion of three": (
        dict(quaternion=[1, 2, 3]),
        "quaternion has shape (3,); 4 numbers are expected",
    ),
    "a quaternion of length zero": (dict(quaternion=np.zeros(4)), "quaternion [0, 0, 0, 0] is no rotation"),
    "a quaternion that is none": (
        dict(quaternion=[1, 0, 0, np.inf]),
        "quaternion [1.0, 0.0, 0.0, inf] is not",
    ),
}


@pytest.mark.parametrize("fault", ATTACH)
def test_attach_refuses(bus, arm, fault):
    arguments, sentence = ATTACH[fault]
    with pytest.raises(jffsr.InputError, match="^robot 'wu_2018_6dof' on 'bus': " + re.escape(sentence)):
        jffsr.attach(bus, arm, **arguments)


def test_attach_names_what_both_have(bus, arm):
    robot = jffsr.attach(bus, arm)
    with pytest.raises(jffsr.InputError) as told:
        jffsr.attach(robot, arm)
    assert str(told.value) == (
        "robot 'wu_2018_6dof' on 'bus': both have a joint named 'joint1'; give the arm a prefix that makes its "
        "names differ, such as 'wu_2018_6dof_'"
    )
    topology = arm.topology
    fields = vars(topology) | {"joint_names": tuple("abcdef")}
    renamed = arm.replace(topology=type(topology)(**fields))
    with pytest.raises(jffsr.InputError, match="both have a body named 'link1'"):
        jffsr.attach(robot, renamed)
    fields["body_names"] = tuple("ghijklm")
    renamed = arm.replace(topology=type(topology)(**fields))
    with pytest.raises(jffsr.InputError, match="both have an end effector named 'tool'"):
        jffsr.attach(robot, renamed)
    with pytest.raises(
        jffsr.InputError, match="link: found 'tol', which 'bus' does not have; did you mean 'tool'"
    ):
        jffsr.attach(robot, arm, link="tol")


def test_wrong_kinds_of_part(bus, arm):
    with pytest.raises(
        jffsr.InputError, match=r"the arm is a RigidBody; a Robot is expected; .* by jffsr\.weld$"
    ):
        jffsr.attach(arm, bus)
    with pytest.raises(jffsr.InputError, match=r"the host is a str; a Robot or a RigidBody is expected"):
        jffsr.attach("wu_6dof", arm)
    with pytest.raises(
        jffsr.InputError, match=r"weld: found a RigidBody and a Robot; a Robot and a RigidBody"
    ):
        jffsr.weld(bus, arm)


def test_weld_refuses_an_unknown_tool(bus, arm):
    with pytest.raises(jffsr.InputError, match=r"has no end effector 'hand'; it has \['tool'\]"):
        jffsr.weld(arm, bus, end_effector="hand")
    with pytest.raises(
        jffsr.InputError, match=r"^rigid body 'bus' on 'wu_2018_6dof': position has shape \(\)"
    ):
        jffsr.weld(arm, bus, position=1.0)


BODIES = {
    "mass zero": (dict(mass=0.0), "mass is 0 kg; it must be positive"),
    "mass of two": (dict(mass=[1.0, 2.0]), "mass has shape (2,), () is expected"),
    "inertia of two": (dict(inertia=[1, 1]), "inertia has shape (2,), (3, 3) is expected"),
    "inertia of no body": (dict(inertia=[1, 1, 3]), "break the triangle inequality: 1 + 1 is less than 3"),
    "com nan": (dict(com=[0, 0, np.nan]), "centre of mass [0.0, 0.0, nan] is not finite"),
}


@pytest.mark.parametrize("fault", BODIES)
def test_a_body_that_cannot_be_is_refused(fault):
    changes, sentence = BODIES[fault]
    arguments = dict(mass=1.0, inertia=[1, 1, 1], com=[0, 0, 0], name="rock") | changes
    with pytest.raises(jffsr.InputError, match="^rigid body 'rock': .*" + re.escape(sentence)):
        jffsr.RigidBody.create(**arguments)


def test_traced_numbers_pass_and_give_a_pytree():
    """Traced values have no number to check; the leaves come back as they went in."""

    def total(mass):
        body = jffsr.RigidBody.create(mass, mass * jnp.ones(3), com=[mass, 0.0, 0.0])
        return sum(jnp.sum(leaf) for leaf in jax.tree.leaves(body))

    assert jax.jit(total)(2.0) == 2.0 + 6.0 + 2.0
    assert jax.grad(total)(2.0) == 5.0
    assert jax.jit(total)(-1.0) == -5.0
    body = jffsr.RigidBody.create(2, [1, 1, 1], name="rock")
    assert [leaf.shape for leaf in jax.tree.leaves(body)] == [(), (3,), (3, 3)]
    assert jax.tree.map(lambda leaf: 2 * leaf, body).name == "rock"
