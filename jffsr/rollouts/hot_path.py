"""The joint terms of a rollout by a recursion made for the compiler: the hot path.

`plain_path` gives the same by the readable kinematics, and is its test. What is unusual here, and why; the times are
of one core of a processor with AVX-512, a seven-axis arm, float64, an evaluation being one point of the grid:

* Composite bodies are summed from the tips inwards. Beyond a joint, mass, first moment, inertia and the momentum of
  the joints further out are all that counts: 15 numbers pass from body to body, and no pose or velocity of a body
  is ever formed. That is less than half of the operations of a sum over bodies in the base frame (with polynomials
  for sine and cosine 7,700 rollouts of 200 steps a second on two cores, instead of 1,800).
* Each body's frame is turned so that z is its joint's axis (`JointConstants`): the joint's turn is then a plane
  rotation, and its rate adds three products to the momentum.
* Every component is an array over the grid, so that each operation is one long loop that the compiler can put into
  vector registers (`spatial.components`), of 512 bits (`jffsr.compiling`: 100 ns instead of 128); sine and cosine
  are polynomials (`spatial.trigonometry`: under 5 ns for both instead of 18).
* The barriers keep the compiler from computing a producer again for each of its consumers (unrolled, 108 ns with
  them and 421 ns without).
* Joints of an unbranched part of the tree are one loop, so that it compiles once: 0.8 s instead of 4 s unrolled.

Frames chosen so that each way from joint to joint is two plane rotations (Denavit and Hartenberg) would save up to a
fifth more, but have no derivative by the robot's geometry where axes are parallel. Blocks of the grid small enough
for the first-level cache gain a tenth in float64 and lose a third in float32.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.robots.robot import Robot, Topology
from jffsr.rollouts.joint_terms import JointTerms
from jffsr.spatial.components import (
    Components,
    Rows,
    Symmetric,
    add,
    cross,
    point_inertia,
    rows_times,
    scale,
    subtract,
    symmetric_elements,
    symmetric_inverse,
    symmetric_times,
    symmetric_turned,
)
from jffsr.spatial.inertia import parallel_axis
from jffsr.spatial.rotation import frame_along
from jffsr.spatial.trigonometry import sine_cosine
from jffsr.types import Array


def hot_joint_terms(robot: Robot, joint_position: Array, joint_velocity: Array) -> JointTerms:
    """Terms of a grid of joint positions and rates, (G, n) each."""
    carried = _inwards(robot, jnp.asarray(joint_position).T, jnp.asarray(joint_velocity).T)
    total = jnp.sum(jnp.asarray(robot.mass))
    com = scale(1 / total, carried.first)
    base = jnp.asarray(robot.inertia)[0]
    locked = tuple(
        own + part - total * shift
        for own, part, shift in zip(
            symmetric_elements(base), carried.inertia, point_inertia(com), strict=True
        )
    )
    angular = subtract(carried.angular, cross(com, carried.linear))
    inverse, angular = jax.lax.optimization_barrier((symmetric_inverse(locked), angular))
    terms = JointTerms(
        inverse_inertia=inverse,
        joint_rate=symmetric_times(inverse, angular),
        com=com,
        com_velocity=scale(1 / total, carried.linear),
    )
    return jax.lax.optimization_barrier(terms)


class Carried(NamedTuple):
    """What a joint carries, about a point and in a frame that the step names; leaves (G,), mass ().

    mass; first, its first moment; inertia about the point; linear and angular, the momentum of the motion
    relative to the frame.
    """

    mass: Array
    first: Components
    inertia: Symmetric
    linear: Components
    angular: Components


class JointConstants(NamedTuple):
    """Constants of the joints, leaves (n, ...): the way from each body's frame to that of its parent.

    Frames are the bodies' own, turned so that z is the joint's axis. mass (n,), first (n, 3) and inertia
    (n, 6), about the joint, of the body; rotation (n, 3, 3) and offset (n, 3) of its frame in the parent's
    at joint position zero.
    """

    mass: Array
    first: Array
    inertia: Array
    rotation: Array
    offset: Array


def joint_constants(robot: Robot) -> JointConstants:
    mass, com = jnp.asarray(robot.mass)[1:], jnp.asarray(robot.link_com)
    turned = frame_along(jnp.asarray(robot.joint_axis))
    before = jnp.concatenate([jnp.eye(3, dtype=turned.dtype)[None], turned])[np.array(robot.topology.parents)]
    about_joint = jnp.asarray(robot.inertia)[1:] + mass[:, None, None] * parallel_axis(com)
    inertia = jnp.einsum("nji,njk,nkl->nil", turned, about_joint, turned)
    return JointConstants(
        mass=mass,
        first=jnp.einsum("nji,nj->ni", turned, mass[:, None] * com),
        inertia=jnp.stack(symmetric_elements(inertia), axis=-1),
        rotation=jnp.einsum("nji,njk,nkl->nil", before, jnp.asarray(robot.joint_rotation), turned),
        offset=jnp.einsum("nji,nj->ni", before, jnp.asarray(robot.joint_position)),
    )


def _inwards(robot: Robot, q: Array, qd: Array) -> Carried:
    """What the base carries, about its centre of mass and in its frame, at joint positions and rates (n, G)."""
    topology, constants = robot.topology, joint_constants(robot)
    zero = jnp.zeros_like(q[0])
    nothing = Carried(jnp.zeros_like(constants.mass[0]), (zero,) * 3, (zero,) * 6, (zero,) * 3, (zero,) * 3)
    on_body: dict[int, list[Carried]] = {}
    for root, joints in reversed(unbranched_parts(topology)):
        turning = topology.is_revolute[list(joints)]
        index = np.array(joints[::-1])
        inputs = jax.tree.map(lambda x, index=index: x[index], (constants, q, qd))
        if turning.any() and not turning.all():
            inputs = (*inputs, turning[::-1].copy())
        kind = turning[0] if len(inputs) == 3 else None
        start = summed(on_body.pop(joints[-1] + 1, [nothing]))
        carried, _ = jax.lax.scan(lambda c, x, kind=kind: (_step(c, *x, kind=kind), None), start, inputs)
        on_body.setdefault(root, []).append(carried)
    return summed(on_body[0])


def unbranched_parts(topology: Topology) -> list[tuple[int, tuple[int, ...]]]:
    """Unbranched parts of the tree: the body that each hangs from, and its joints from there outwards."""
    children: dict[int, list[int]] = {}
    for joint, parent in enumerate(topology.parents):
        children.setdefault(parent, []).append(joint)
    found = []

    def follow(root: int) -> None:
        for joint in children.get(root, []):
            joints = [joint]
            while len(children.get(joints[-1] + 1, [])) == 1:
                joints.append(children[joints[-1] + 1][0])
            found.append((root, tuple(joints)))
            follow(joints[-1] + 1)

    follow(0)
    return found


def summed(parts: list[Carried]) -> Carried:
    return jax.tree.map(lambda *x: sum(x[1:], start=x[0]), *parts)


def _step(carried: Carried, body: JointConstants, q: Array, qd: Array, turns=None, *, kind=None) -> Carried:
    """Take up one body and pass its joint: from about the outer joints to about the parent's frame."""
    return passed(taken_up(carried, body), body, q, qd, turns, kind=kind)


def taken_up(carried: Carried, body: JointConstants) -> Carried:
    """With a body's own mass, first moment and inertia, in its frame and about its joint."""
    first = add(carried.first, tuple(body.first))
    inertia = tuple(a + b for a, b in zip(carried.inertia, tuple(body.inertia), strict=True))
    return Carried(carried.mass + body.mass, first, inertia, carried.linear, carried.angular)


def passed(state: Carried, body: JointConstants, q: Array, qd: Array, turns=None, *, kind=None) -> Carried:
    """The same from a body's frame to its parent's, by a joint of this position and rate.

    kind says whether the joint turns (else it slides); None leaves it to `turns`, a traced flag.
    """
    if kind is None:
        # A joint of the other kind is passed at zero and at rest.
        state = _slid(state, jnp.where(turns, 0.0, q), jnp.where(turns, 0.0, qd))
        q, qd = jnp.where(turns, q, 0.0), jnp.where(turns, qd, 0.0)
    state = _slid(state, q, qd) if kind is not None and not kind else _turned(state, q, qd)
    state = jax.lax.optimization_barrier(state)
    return jax.lax.optimization_barrier(_placed(state, body.rotation, tuple(body.offset)))


def _turned(c: Carried, q: Array, qd: Array) -> Carried:
    """After a turn about z: the rate's momentum added, all components turned."""
    x, y, z = c.first
    xx, yy, zz, xy, xz, yz = c.inertia
    px, py, pz = c.linear
    lx, ly, lz = c.angular
    px, py = px - qd * y, py + qd * x
    lx, ly, lz = lx + qd * xz, ly + qd * yz, lz + qd * zz
    sine, cosine = jax.lax.optimization_barrier(sine_cosine(q))

    def turn(a: Array, b: Array) -> tuple[Array, Array]:
        return cosine * a - sine * b, sine * a + cosine * b

    # The pair (half the difference, xy) turns by the double angle.
    mean, half = 0.5 * (xx + yy), 0.5 * (xx - yy)
    double_cosine, double_sine = cosine * cosine - sine * sine, 2 * sine * cosine
    spread = double_cosine * half - double_sine * xy
    inertia = (mean + spread, mean - spread, zz, double_sine * half + double_cosine * xy, *turn(xz, yz))
    return Carried(c.mass, (*turn(x, y), z), inertia, (*turn(px, py), pz), (*turn(lx, ly), lz))


def _slid(c: Carried, q: Array, qd: Array) -> Carried:
    """After a slide along z."""
    x, y, z = c.first
    xx, yy, zz, xy, xz, yz = c.inertia
    px, py, pz = c.linear
    lx, ly, lz = c.angular
    pz = pz + qd * c.mass
    lx, ly = lx + qd * y, ly - qd * x
    # And now about the point that the joint started from.
    shift = q * (2 * z + c.mass * q)
    inertia = (xx + shift, yy + shift, zz, xy, xz - q * x, yz - q * y)
    return Carried(c.mass, (x, y, z + c.mass * q), inertia, (px, py, pz), (lx - q * py, ly + q * px, lz))


def _placed(c: Carried, rotation: Array, offset: Components) -> Carried:
    """In the parent's frame and about its origin."""
    rows: Rows = tuple(tuple(rotation[r, k] for k in range(3)) for r in range(3))
    first, linear = rows_times(rows, c.first), rows_times(rows, c.linear)
    angular = add(rows_times(rows, c.angular), cross(offset, linear))
    # |v|^2 1 - v v' of v = first/mass + offset, less that of first/mass: bilinear in the two.
    x, y, z = offset
    a, b, d = first
    mixed = (
        2 * (b * y + d * z), 2 * (a * x + d * z), 2 * (a * x + b * y),
        -(a * y + b * x), -(a * z + d * x), -(b * z + d * y),
    )  # fmt: skip
    own = symmetric_turned(rows, c.inertia)
    constant = point_inertia(offset)
    inertia = tuple(o + m + c.mass * k for o, m, k in zip(own, mixed, constant, strict=True))
    return Carried(c.mass, add(first, scale(c.mass, offset)), inertia, linear, angular)
