"""Pinocchio in C++, compiled from the wheel's headers: a rollout at a time, the batch split over threads."""

from __future__ import annotations

import ctypes
from functools import cache
from pathlib import Path

import numpy as np

from experiments.benchmarks.bodies import law_joints, law_table, turned_bodies
from experiments.benchmarks.cases import FLOAT64, Case
from experiments.benchmarks.native.build import library, pointer
from experiments.benchmarks.opponents.program import Program, Unsupported


def rollouts(case: Case, threads: int, shared: bool = False) -> Program:
    """Final base quaternions (batch, 4)."""
    code, seconds, robot = _robot(case)
    table = law_table(case)
    free, out = np.ascontiguousarray(case.free), np.empty((case.batch, 4))

    def run():
        code.rollouts(
            robot, pointer(table), ctypes.c_double(case.step), case.steps, pointer(free), case.batch,
            pointer(out), int(shared), threads,
        )  # fmt: skip
        return out

    return Program(run, seconds, case.batch)


def twists(case: Case, threads: int) -> Program:
    """Base twists (batch, 6) of single evaluations."""
    code, seconds, robot = _robot(case)
    position, rate, attitude = (np.ascontiguousarray(x) for x in case.postures)
    out = np.empty((case.batch, 6))

    def run():
        code.twists(
            robot, pointer(position), pointer(rate), pointer(attitude), case.batch, pointer(out), threads
        )
        return out

    return Program(run, seconds, case.batch)


@cache
def include_folders() -> tuple[Path, ...]:
    """Where the wheel has its headers and those of Eigen."""
    import pinocchio

    # The package is in PREFIX/lib/pythonX.Y/site-packages, or in the environment's own next to PREFIX.
    for folder in Path(pinocchio.__file__).resolve().parents:
        for prefix in (folder, folder / "cmeel.prefix"):
            if (prefix / "include" / "pinocchio" / "multibody.hpp").is_file():
                include = prefix / "include"
                if not (include / "eigen3" / "Eigen" / "Core").is_file():
                    raise ImportError("Pinocchio's wheel is there, but not Eigen's headers (cmeel-eigen)")
                return include, include / "eigen3"
    raise ImportError("the installed Pinocchio has no C++ headers")


def with_pinocchio(source: str) -> tuple[ctypes.CDLL, float]:
    """A source of `native` compiled against the wheel's headers, and the seconds that it took."""
    # The list of joint types is longer than Boost's lists are by default.
    boost = ("-DBOOST_MPL_LIMIT_LIST_SIZE=30", "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS")
    return library(source, *boost, *(f"-isystem{folder}" for folder in include_folders()))


def _library():
    code, seconds = with_pinocchio("pinocchio.cpp")
    code.make_robot.restype = ctypes.c_void_p
    return code, seconds


def _robot(case: Case):
    """The library, its compile time, and a model that lives as long as the process."""
    if case.precision != FLOAT64:
        raise Unsupported("compiled for float64")
    code, seconds = _library()
    bodies, joints = turned_bodies(case.robot), law_joints(case)
    parents = np.array(bodies.parents, dtype=np.int32)
    numbers = (bodies.rotation, bodies.offset, bodies.mass, bodies.com, bodies.inertia, joints)
    numbers = [np.ascontiguousarray(x) for x in numbers]
    handle = code.make_robot(len(parents), ctypes.c_void_p(parents.ctypes.data), *map(pointer, numbers))
    return code, seconds, ctypes.c_void_p(handle)
