"""The ceiling: the arithmetic of jffsr's rollout as a C++ kernel, the batch in the lanes of vector registers."""

from __future__ import annotations

import ctypes

import numpy as np

from experiments.benchmarks.bodies import law_joints, law_table, turned_bodies
from experiments.benchmarks.cases import FLOAT64, Case
from experiments.benchmarks.native.build import library, pointer
from experiments.benchmarks.opponents.program import Program, Unsupported


def rollouts(case: Case, threads: int) -> Program:
    """Final base quaternions (batch, 4)."""
    code, seconds = _library(case)
    system, law = _System(case), law_table(case)
    free, out = np.ascontiguousarray(case.free), np.empty((case.batch, 4))

    def run():
        code.rollouts(
            *system.arguments(), pointer(law), ctypes.c_double(case.step), case.steps, pointer(free), case.batch,
            pointer(out), threads,
        )  # fmt: skip
        return out

    return Program(run, seconds)


def twists(case: Case, threads: int) -> Program:
    """Base twists (batch, 6) of single evaluations."""
    code, seconds = _library(case)
    system, out = _System(case), np.empty((case.batch, 6))
    inputs = [np.ascontiguousarray(x) for x in case.postures]

    def run():
        code.twists(*system.arguments(), *map(pointer, inputs), case.batch, pointer(out), threads)
        return out

    return Program(run, seconds)


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


class _System:
    """The kernel's leading arguments, and the arrays behind them."""

    def __init__(self, case: Case):
        bodies = turned_bodies(case.robot)
        carried = bodies.mass.copy()
        for i in reversed(range(len(bodies.parents))):
            carried[bodies.parents[i]] += carried[i + 1]
        rows = []
        for i in range(len(bodies.parents)):
            mass, com = bodies.mass[i + 1], bodies.com[i + 1]
            about_joint = bodies.inertia[i + 1] + mass * (com @ com * np.eye(3) - np.outer(com, com))
            numbers = (mass, carried[i + 1], mass * com, _elements(about_joint))
            rows.append(
                np.concatenate([np.ravel(x) for x in (*numbers, bodies.rotation[i], bodies.offset[i])])
            )
        self.bodies = np.ascontiguousarray(rows)
        self.joints = law_joints(case)
        self.base = _elements(bodies.inertia[0])
        self.mass = float(bodies.mass.sum())

    def arguments(self):
        """Body table, joint table, elements of the base's inertia, total mass."""
        return pointer(self.bodies), pointer(self.joints), pointer(self.base), ctypes.c_double(self.mass)


def _elements(matrix: np.ndarray) -> np.ndarray:
    return np.array([matrix[r, k] for r, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))])
