"""Kept programs: found again by another process, named by everything that matters, and never in the way."""

from __future__ import annotations

import os
import subprocess
import sys

import jax
import numpy as np
import pytest

from jffsr.compiling import ONCE, OPTIONS, Program, store
from jffsr.compiling.naming import digest
from jffsr.robots.robot import Robot
from jffsr.spatial.rotation import quaternion_multiply, quaternion_to_matrix

TURN = np.array([np.cos(0.5), 0.0, np.sin(0.5), 0.0])


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A store of the test's own."""
    monkeypatch.setattr(store, "_folder", tmp_path)
    return tmp_path


def untraceable(program: Program, monkeypatch) -> Program:
    """The program, which now can only be loaded."""

    class Refused:
        def lower(self, *args):
            raise AssertionError("was traced")

    monkeypatch.setattr(program, "_jit", Refused())
    return program


def test_a_kept_program_is_neither_traced_nor_compiled_again(folder, monkeypatch):
    first = Program(quaternion_multiply)(TURN, TURN)
    assert [path.suffix for path in folder.iterdir()] == [".program"]
    second = untraceable(Program(quaternion_multiply), monkeypatch)(TURN, TURN)
    np.testing.assert_array_equal(first, second)
    with pytest.raises(AssertionError, match="was traced"):
        untraceable(Program(quaternion_multiply), monkeypatch)(TURN, np.stack([TURN, TURN]))


@pytest.mark.parametrize("content", [b"", b"no program", "half"])
def test_a_damaged_file_is_compiled_anew(folder, content):
    expected = Program(quaternion_multiply)(TURN, TURN)
    (path,) = folder.iterdir()
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2] if content == "half" else content)
    np.testing.assert_array_equal(Program(quaternion_multiply)(TURN, TURN), expected)
    assert path.stat().st_size > 100


def test_a_folder_that_has_gone_is_no_hindrance(folder):
    folder.rmdir()
    np.testing.assert_allclose(Program(quaternion_multiply)(TURN, TURN)[0], np.cos(1.0))


def test_within_a_mesh_they_are_kept_for_it(folder, monkeypatch):
    with jax.set_mesh(jax.make_mesh((1,), ("batch",), (jax.sharding.AxisType.Auto,))):
        made = Program(quaternion_multiply)(TURN, TURN)
        found = untraceable(Program(quaternion_multiply), monkeypatch)(TURN, TURN)
    assert made.sharding.mesh.axis_names == found.sharding.mesh.axis_names == ("batch",)
    np.testing.assert_array_equal(found, made)


def own(x):
    return x + 1


def test_a_users_function_is_not_kept(folder, robots):
    assert Program(own)(1.0) == 2.0
    assert Program(lambda x: x)(1.0) == 1.0
    assert store.name_of(quaternion_multiply, OPTIONS, [own], [TURN], jax.sharding.get_mesh()) is None
    assert list(folder.iterdir()) == []


def test_names_tell_apart_what_differs(robots):
    def name(*dynamic, function=quaternion_multiply, options=OPTIONS, static=()):
        return digest(function, options, list(static), list(dynamic), jax.sharding.get_mesh())

    robot: Robot = robots["hu_2011_planar2"]
    heavier = robot.replace(mass=np.asarray(robot.mass) * 2)
    assert name(robot) == name(heavier)
    names = [
        name(robot),
        name(robots["ye_2019_planar3"]),
        name(TURN),
        name(np.float32(TURN)),
        name(np.stack([TURN, TURN])),
        name([TURN]),
        name(1.0),
        name(np.float64(1.0)),
        name(TURN, function=quaternion_to_matrix),
        name(TURN, options=ONCE),
        name(TURN, static=[1]),
        name(TURN, static=[True]),
        name(TURN, static=["1"]),
    ]
    with jax.enable_x64(False):
        names.append(name(TURN))
    with jax.set_mesh(jax.make_mesh((1,), ("batch",), (jax.sharding.AxisType.Auto,))):
        names.append(name(TURN))
    assert len(set(names)) == len(names)


SCRIPT = """
import sys
import jax, jax.monitoring, numpy as np
from jffsr.compiling import Program
from jffsr.compiling.keeping import keep_programs
from jffsr.dynamics.kinematics import kinematics
from jffsr.dynamics.momentum import base_twist
from jffsr.robots.loading import load_robot
from jffsr.robots.state import State
jax.config.update("jax_enable_x64", True)
keep_programs()
counts = {}
def count(event, *rest, **more):
    counts[event.split("/")[-1]] = counts.get(event.split("/")[-1], 0) + 1
robot = load_robot("hu_2011_planar2")
state = State(np.zeros(3), np.array([1.0, 0, 0, 0]), np.array([0.3, 0.4]))
kin = jax.eval_shape(lambda s: kinematics(robot, s), state)
kin = jax.tree.map(lambda x: np.random.default_rng(0).normal(size=x.shape), kin)
jax.monitoring.register_event_listener(count)
jax.monitoring.register_event_duration_secs_listener(count)
twist = Program(base_twist)(robot, kin, np.array([0.1, 0.2]))
loaded = counts.get("compile_requests_use_cache", 0) == 0
print("loaded" if loaded else "compiled", counts.get("cache_hits", 0), np.asarray(twist).tobytes().hex())
"""


@pytest.mark.slow
@pytest.mark.parametrize("rounds", [1, 2])
def test_other_processes_find_it_and_its_lapack_calls_work(tmp_path, rounds):
    """Base twists need LAPACK. In each round a process finds it in JAX's cache alone, the next what that one kept."""
    environment = {**os.environ, "JFFSR_CACHE_DIR": str(tmp_path)}
    said = []
    for delete in (False, *(True, False) * rounds):
        if delete:
            for path in tmp_path.glob("*.program"):
                path.unlink()
        done = subprocess.run(
            [sys.executable, "-W", "error", "-c", SCRIPT], capture_output=True, text=True, env=environment
        )
        assert done.returncode == 0, done.stderr
        assert done.stderr == ""
        said.append(done.stdout.split())
    assert [line[0] for line in said] == ["compiled", *["compiled", "loaded"] * rounds]
    assert [line[1] for line in said] == ["0", *["1", "0"] * rounds]
    assert len({line[2] for line in said}) == 1
