"""Composition under jit and vmap, and gradients through it that finite differences confirm."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from composition_parts import INERTIA, POSITION, QUATERNION, furnished

import jffsr
from jffsr.robots.builder import build_robot
from jffsr.robots.geometry import Shape

ARM = jffsr.load_robot("hu_2011_planar2")
NUMBERS = dict(
    position=POSITION,
    quaternion=QUATERNION,
    mass=np.array(7.0),
    com=np.array([0.3, 0.2, -0.1]),
    bus=np.array(50.0),
    arm_mass=ARM.mass,
    arm_root=np.array([0.1, -0.2, 0.3]),
)


@pytest.fixture(scope="module")
def value():
    def value(numbers):
        """A number that all inputs of a composition move."""
        bus = jffsr.RigidBody.create(numbers["bus"], INERTIA, com=[0.1, 0.0, -0.2], name="bus")
        arm = ARM.replace(mass=numbers["arm_mass"], root_position=numbers["arm_root"])
        robot = jffsr.attach(
            bus, arm, position=numbers["position"], quaternion=numbers["quaternion"], arm_base="keep"
        )
        target = jffsr.RigidBody.create(
            numbers["mass"], numbers["mass"] * jnp.asarray(INERTIA) / 5, com=numbers["com"]
        )
        robot = jffsr.weld(robot, target, position=[0.1, 0.2, 0.0], quaternion=[1.0, 0.2, 0.0, 0.1])
        assert isinstance(robot.limits.torque, np.ndarray)
        state = jffsr.State(jnp.zeros(3), jnp.array([1.0, 0, 0, 0]), jnp.array([0.4, -0.9]))
        inertia = jffsr.generalized_inertia(robot, jffsr.kinematics(robot, state))
        return jnp.sum(inertia * jnp.array([[1.0, -2.0], [0.5, 3.0]]))

    return value


def test_jit_and_vmap_give_the_numbers_of_the_host(value):
    expected = float(value(NUMBERS))
    np.testing.assert_allclose(jax.jit(value)(NUMBERS), expected, rtol=1e-13)
    many = np.stack([POSITION, POSITION + 0.5, np.zeros(3)])
    along = dict.fromkeys(NUMBERS) | {"position": 0}
    found = jax.jit(jax.vmap(value, in_axes=(along,)))(NUMBERS | {"position": many})
    np.testing.assert_allclose(found, [float(value(NUMBERS | {"position": p})) for p in many], rtol=1e-13)


def test_gradients_are_finite_differences(value):
    compiled = jax.jit(value)
    gradient = jax.jit(jax.grad(value))(NUMBERS)
    step = 1e-4
    for name, array in NUMBERS.items():
        direction = np.random.default_rng(5).normal(size=array.shape)

        def shifted(by, name=name, array=array, direction=direction):
            return float(compiled(NUMBERS | {name: array + by * step * direction}))

        expected = (8 * (shifted(1) - shifted(-1)) - (shifted(2) - shifted(-2))) / (12 * step)
        assert abs(expected) > 1e-3, f"the number does not depend on {name}: the test shows nothing"
        np.testing.assert_allclose(np.sum(gradient[name] * direction), expected, rtol=1e-8)


def test_shapes_at_traced_places_are_left_out():
    """A static shape has no traced place: those of the arm's base go, and of the base whose centre moves."""
    host = arm = build_robot(furnished())
    kept = []

    def compose(position, link):
        robot = jffsr.attach(host, arm, position=position, link=link, prefix="b_")
        kept.append({shape.name for shape in robot.geometry.shapes})
        return robot.mass

    jax.jit(compose, static_argnums=1)(POSITION, None)
    jax.jit(compose, static_argnums=1)(POSITION, "left")
    compose(jnp.asarray(POSITION), None)
    assert kept == [{"palm", "b_palm"}, {"hull", "palm", "b_palm"}, {"hull", "palm", "b_hull", "b_palm"}]


def test_a_targets_shapes_do_not_hang_on_its_traced_numbers():
    """They are placed by the target's own frame, so that estimates of mass and centre of mass leave them alone."""
    sphere = Shape("sphere", "sphere", "any", np.array([0.5, 0.0, 0.0]), np.eye(3), np.array([0.2]))
    robot, kept = ARM, []

    @jax.jit
    def compose(mass, com):
        target = jffsr.RigidBody.create(mass, mass * jnp.ones(3), com=com, name="rock", shapes=[sphere])
        compound = jffsr.weld(robot, target, position=[1.0, 0.0, 0.0])
        kept.extend(shape for shape in compound.geometry.shapes if shape.name == "sphere")
        return compound.mass

    np.testing.assert_allclose(compose(3.0, POSITION), robot.mass + np.array([0.0, 0.0, 3.0]))
    (shape,) = kept
    assert shape.body == robot.body_names[2]
    np.testing.assert_allclose(shape.position, robot.end_effector_position[0] + [1.5, 0.0, 0.0])
