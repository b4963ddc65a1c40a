"""Pinocchio for tracking, in C++ and from Python: generalized Jacobians, and steps at zero momentum."""

from __future__ import annotations

import ctypes

import numpy as np

from experiments.benchmarks.bodies import turned_bodies, z_along
from experiments.benchmarks.native.build import pointer
from experiments.benchmarks.opponents.pinocchio_cpp import with_pinocchio
from experiments.benchmarks.opponents.program import Program
from experiments.benchmarks.tracking_case import EPSILON, INNER, LARGEST, PERIOD, TrackingCase

LARGEST_BATCH = 64
"""States that Python does one after another."""


def jacobians(case: TrackingCase, threads: int, shared: bool = False) -> Program:
    """J* (K, 6, n) in C++; shared takes the Jacobians that crba leaves behind in the world's frame."""
    code, seconds, arm = _arm(case)
    q, quaternion, _ = (np.ascontiguousarray(x) for x in case.postures)
    out = np.empty((len(q), 6, case.robot.num_joints))

    def run():
        code.generalized_jacobians(
            arm, pointer(q), pointer(quaternion), len(q), pointer(out), int(shared), threads
        )
        return out.copy()

    return Program(run, seconds)


def steps(case: TrackingCase, threads: int) -> Program:
    """Joints, base pose and singular values (K, n + 13) of one step in C++."""
    code, seconds, arm = _arm(case)
    q, quaternion, twist = (np.ascontiguousarray(x) for x in case.postures)
    out = np.empty((len(q), case.robot.num_joints + 13))

    def run():
        code.steps(
            arm, pointer(q), pointer(quaternion), pointer(twist), ctypes.c_double(LARGEST), ctypes.c_double(EPSILON),
            ctypes.c_double(PERIOD), INNER, len(q), pointer(out), threads,
        )  # fmt: skip
        return out.copy()

    return Program(run, seconds)


def python_jacobians(case: TrackingCase) -> Program:
    """J* of the first few states from Python."""
    jacobian = _python_arm(case)[0]
    rows = [x[:LARGEST_BATCH] for x in case.postures]
    return Program(
        lambda: np.array([jacobian(q, quaternion) for q, quaternion, _ in zip(*rows, strict=True)]),
        0.0,
        len(rows[0]),
    )


def python_steps(case: TrackingCase) -> Program:
    """Steps of the first few states from Python."""
    jacobian, base_at, turned = _python_arm(case)
    rows, h = [x[:LARGEST_BATCH] for x in case.postures], PERIOD / INNER

    def one(q, quaternion, twist):
        u, sigma, vh = np.linalg.svd(jacobian(q, quaternion))
        lamb = np.where(sigma < EPSILON, 0.5 * LARGEST * (1 + np.cos(np.pi * sigma / EPSILON)), 0.0)
        rate = vh.T @ (sigma / (sigma**2 + lamb**2) * (u.T @ twist))

        def slope(x, v):
            w, a = x[0], x[1:]
            spin = v[3:]
            turning = 0.5 * np.concatenate([[-(a @ spin)], w * spin + np.cross(a, spin)])
            return turning, turned(x / np.sqrt(x @ x)) @ v[:3]

        position, x, before = np.zeros(3), quaternion.copy(), base_at(q, rate)
        for s in range(INNER):
            middle, after = base_at(q + (s + 0.5) * h * rate, rate), base_at(q + (s + 1) * h * rate, rate)
            k1, v1 = slope(x, before)
            k2, v2 = slope(x + h / 2 * k1, middle)
            k3, v3 = slope(x + h / 2 * k2, middle)
            k4, v4 = slope(x + h * k3, after)
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            x, before = x / np.sqrt(x @ x), after
            position = position + h / 6 * (v1 + 2 * v2 + 2 * v3 + v4)
        return np.concatenate([q + PERIOD * rate, position, x, sigma])

    return Program(lambda: np.array([one(*row) for row in zip(*rows, strict=True)]), 0.0, len(rows[0]))


def _tool(case: TrackingCase) -> tuple[int, np.ndarray]:
    """The body that carries the tool, and the tool's place in that body's frame, its z axis the joint's."""
    topology, robot = case.robot.topology, case.robot
    body = topology.end_effector_bodies[0]
    turn = z_along(np.asarray(robot.joint_axis[body - 1], float))
    return body, np.ascontiguousarray(turn.T @ np.asarray(robot.end_effector_position[0], float))


def _arm(case: TrackingCase):
    code, seconds = with_pinocchio("tracking.cpp")
    code.make_arm.restype = ctypes.c_void_p
    bodies, (tool, offset) = turned_bodies(case.robot), _tool(case)
    parents = np.array(bodies.parents, dtype=np.int32)
    numbers = (bodies.rotation, bodies.offset, bodies.mass, bodies.com, bodies.inertia)
    numbers = [np.ascontiguousarray(x) for x in numbers]
    handle = code.make_arm(
        len(parents), ctypes.c_void_p(parents.ctypes.data), *map(pointer, numbers), tool, pointer(offset)
    )
    return code, seconds, ctypes.c_void_p(handle)


def _python_arm(case: TrackingCase):
    """J* of joints and a quaternion; base velocity in its own frame of joints and rates; rotation of a quaternion."""
    import pinocchio as pin

    bodies, (tool, offset) = turned_bodies(case.robot), _tool(case)
    model, place = pin.Model(), pin.SE3.Identity()
    ids = [model.addJoint(0, pin.JointModelFreeFlyer(), place, "base")]
    for i, parent in enumerate(bodies.parents):
        here = pin.SE3(bodies.rotation[i], bodies.offset[i])
        ids.append(model.addJoint(ids[parent], pin.JointModelRZ(), here, f"joint{i}"))
    for joint, mass, com, inertia in zip(ids, bodies.mass, bodies.com, bodies.inertia, strict=True):
        model.appendBodyToJoint(joint, pin.Inertia(float(mass), com, inertia), place)
    frame = model.addFrame(pin.Frame("tool", ids[tool], pin.SE3(np.eye(3), offset), pin.FrameType.OP_FRAME))
    data, configuration = model.createData(), np.zeros(7 + len(bodies.parents))
    configuration[6] = 1.0

    def base_map():
        block = np.triu(data.M[:6, :6])
        block = block + block.T - np.diag(np.diag(block))
        return -np.linalg.solve(block, data.M[:6, 6:])

    def jacobian(q, quaternion):
        configuration[3:6], configuration[6], configuration[7:] = quaternion[1:], quaternion[0], q
        pin.computeJointJacobians(model, data, configuration)
        pin.crba(model, data, configuration)
        pin.updateFramePlacements(model, data)
        whole = pin.getFrameJacobian(model, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        return whole[:, 6:] + whole[:, :6] @ base_map()

    def base_at(q, rate):
        configuration[7:] = q
        pin.crba(model, data, configuration)
        return base_map() @ rate

    return jacobian, base_at, lambda quaternion: pin.Quaternion(*quaternion).matrix()
