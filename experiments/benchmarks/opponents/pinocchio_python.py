"""Pinocchio from Python: base twist from `crba`, Runge-Kutta on the quaternion in NumPy, a rollout at a time."""

from __future__ import annotations

import numpy as np

from experiments.benchmarks.bodies import law_joints, law_table, turned_bodies
from experiments.benchmarks.cases import FLOAT64, Case
from experiments.benchmarks.opponents.program import Program, Unsupported

LARGEST_BATCH = 8


def rollouts(case: Case, threads: int) -> Program:
    """Final base quaternions of the first few candidates."""
    base_twist, n = _base_twist(case), case.robot.num_joints
    law, joints, step = law_table(case), law_joints(case), case.step
    batch = min(case.batch, LARGEST_BATCH)

    def one(free):
        alpha, beta = free[:n], free[n:]

        def slope(row, x):
            shape = alpha + beta * row[4]
            argument = joints[:, 2] + joints[:, 3] * row[0] + row[2] * shape
            rate = joints[:, 3] * row[1] + row[3] * shape + row[5] * beta
            q = joints[:, 0] + joints[:, 1] * np.sin(argument)
            qd = joints[:, 1] * np.cos(argument) * rate
            omega = base_twist(q, qd, x / np.sqrt(x @ x))[3:]
            w, v = x[0], x[1:]
            return 0.5 * np.concatenate([[-(v @ omega)], w * omega + np.cross(v, omega)])

        x = np.array([1.0, 0.0, 0.0, 0.0])
        for i in range(case.steps):
            k1 = slope(law[2 * i], x)
            k2 = slope(law[2 * i + 1], x + step / 2 * k1)
            k3 = slope(law[2 * i + 1], x + step / 2 * k2)
            k4 = slope(law[2 * i + 2], x + step * k3)
            x = x + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            x = x / np.sqrt(x @ x)
        return x

    return Program(lambda: np.array([one(free) for free in case.free[:batch]]), 0.0, batch)


def twists(case: Case, threads: int) -> Program:
    """Base twists of the first few postures, the linear part and the angular one in I."""
    from pinocchio import Quaternion

    base_twist, batch = _base_twist(case), min(case.batch, 64 * LARGEST_BATCH)
    rows = [x[:batch] for x in case.postures]

    def run():
        found = []
        for q, qd, quaternion in zip(*rows, strict=True):
            twist, turn = base_twist(q, qd, quaternion), Quaternion(*quaternion).matrix()
            found.append(np.concatenate([turn @ twist[:3], turn @ twist[3:]]))
        return np.array(found)

    return Program(run, 0.0, batch)


def _base_twist(case: Case):
    """Base twist (6,) in the base's own frame of joint positions, rates and a quaternion (w, x, y, z)."""
    import pinocchio as pin

    if case.precision != FLOAT64:
        raise Unsupported("float64 only")
    bodies = turned_bodies(case.robot)
    model = pin.Model()
    place = pin.SE3.Identity()
    ids = [model.addJoint(0, pin.JointModelFreeFlyer(), place, "base")]
    for i, parent in enumerate(bodies.parents):
        here = pin.SE3(bodies.rotation[i], bodies.offset[i])
        ids.append(model.addJoint(ids[parent], pin.JointModelRZ(), here, f"joint{i}"))
    for joint, mass, com, inertia in zip(ids, bodies.mass, bodies.com, bodies.inertia, strict=True):
        model.appendBodyToJoint(joint, pin.Inertia(float(mass), com, inertia), place)
    data, configuration = model.createData(), np.zeros(7 + len(bodies.parents))

    def of(q, qd, quaternion):
        configuration[3:6], configuration[6], configuration[7:] = quaternion[1:], quaternion[0], q
        mass = pin.crba(model, data, configuration)
        block = np.triu(mass[:6, :6])
        block = block + block.T - np.diag(np.diag(block))
        return -np.linalg.solve(block, mass[:6, 6:] @ qd)

    return of
