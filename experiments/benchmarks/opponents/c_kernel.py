"""The ceiling: the arithmetic of jffsr's rollout as a C++ kernel, the batch in the lanes of vector registers."""

from __future__ import annotations

import ctypes

import numpy as np

from experiments.benchmarks.bodies import law_joints, law_table, turned_bodies
from experiments.benchmarks.cases import FLOAT64, Case
from experiments.benchmarks.native.build import library, pointer
from experiments.benchmarks.opponents.program import Program, Unsupported

NAME = "vectorised C++ kernel"
NOTE = "the same arithmetic, batch in the vector lanes, g++ -O3 -march=native"


def rollouts(case: Case, threads: int) -> Program:
    """Final base quaternions (batch, 4)."""
    code, seconds = _library(case)
    table, joints = law_table(case), law_joints(case)
    system, keep = _system(case, joints)
    free, out = np.ascontiguousarray(case.free), np.empty((case.batch, 4))

    def run():
        code.rollouts(
            *system, pointer(table), ctypes.c_double(case.step), case.steps, pointer(free), case.batch,
            pointer(out), threads,
        )  # fmt: skip
        return out

    return Program(run, seconds, keep=keep)


def twists(case: Case, threads: int) -> Program:
    """Base twists (batch, 6) of single evaluations."""
    code, seconds = _library(case)
    system, keep = _system(case, law_joints(case))
    position, rate, attitude = (np.ascontiguousarray(x) for x in case.postures)
    out = np.empty((case.batch, 6))

    def run():
        code.twists(
            *system, pointer(position), pointer(rate), pointer(attitude), case.batch, pointer(out), threads
        )
        return out

    return Program(run, seconds, keep=keep)


def operations(case: Case) -> int:
    """Floating-point operations of one rollout."""
    code, _ = _library(case)
    code.operations.restype = ctypes.c_long
    return code.operations(case.steps)


def _library(case: Case):
    if case.precision != FLOAT64:
        raise Unsupported("written for float64")
    parents = case.robot.topology.parents
    return library("kernel.cpp", f"-DJOINTS={len(parents)}", f"-DPARENTS={{{','.join(map(str, parents))}}}")


def _system(case: Case, joints: np.ndarray):
    """The leading arguments of the kernel, and the arrays that must outlive them."""
    bodies = turned_bodies(case.robot)
    carried = bodies.mass.copy()
    for i in reversed(range(len(bodies.parents))):
        carried[bodies.parents[i]] += carried[i + 1]
    rows = []
    for i in range(len(bodies.parents)):
        mass, com = bodies.mass[i + 1], bodies.com[i + 1]
        about_joint = bodies.inertia[i + 1] + mass * (com @ com * np.eye(3) - np.outer(com, com))
        numbers = (mass, carried[i + 1], mass * com, _elements(about_joint), bodies.rotation[i], bodies.offset[i])
        rows.append(np.concatenate([np.ravel(x) for x in numbers]))
    table, base = np.ascontiguousarray(rows), np.ascontiguousarray(_elements(bodies.inertia[0]))
    leading = (pointer(table), pointer(joints), pointer(base), ctypes.c_double(float(bodies.mass.sum())))
    return leading, (table, joints, base)


def _elements(matrix: np.ndarray) -> np.ndarray:
    return np.array([matrix[r, k] for r, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))])
