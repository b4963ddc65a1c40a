"""Fixtures that the whole suite shares: float64, the catalogue, the oracle files."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import jax
import pytest

jax.config.update("jax_enable_x64", True)
# Where in the source an operation was written is looked up for every one, and read by nobody here.
jax.config.update("jax_traceback_in_locations_limit", 0)

from jffsr.compiling import OPTIONS, forget  # noqa: E402

# The tests' own programs get the options of the package's: they have to stand here before the first computation. The
# suite compiles for longer than it computes, so that it leaves out the code generator's optimisations; the heavier
# checks, and the whole suite under `make check-optimised`, have them.
LEVEL = {} if os.environ.get("JFFSR_TESTS_OPTIMISED") else {"xla_backend_optimization_level": 0}
for option, value in {**OPTIONS, **LEVEL}.items():
    os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} --{option}={str(value).lower()}".strip()

from motions import robot_from_record  # noqa: E402

from jffsr.robots.loading import list_robots, load_robot  # noqa: E402
from jffsr.robots.robot import Robot  # noqa: E402

# Bytes of memory above which a worker lets go of compiled programs before the next file: freeing them, and compiling
# again what the next files share, takes seconds.
WORKERS = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
MEMORY = float(os.sysconf("SC_PHYS_PAGES")) * float(os.sysconf("SC_PAGE_SIZE"))
KEPT_MEMORY = min(max(0.5 * MEMORY / WORKERS, 3e9), 8e9)

DATA = Path(__file__).parent / "data"


@dataclass(frozen=True)
class Oracle:
    """One oracle file: its robot, built from the record in the file, and everything else as read."""

    name: str
    robot: Robot
    data: dict


@pytest.fixture(scope="session")
def oracles() -> dict[str, Oracle]:
    """Both oracle files by name."""
    found = {}
    for name in ("wu6", "planar2"):
        data = json.loads((DATA / "oracle" / f"{name}.json").read_text(encoding="utf-8"))
        found[name] = Oracle(name, robot_from_record(data["robot"]), data)
    return found


@pytest.fixture(scope="session")
def robots() -> dict[str, Robot]:
    """Every robot of the catalogue, and the tree of tests/data/robots/two_arms.yaml."""
    found = {name: load_robot(name) for name in list_robots()}
    found["two_arms"] = load_robot(DATA / "robots" / "two_arms.yaml")
    return found


@pytest.fixture(scope="module", autouse=True)
def little_memory() -> Iterator[None]:
    """Compiled programs are let go of between files, for those of the whole suite take gigabytes a worker."""
    yield
    if _resident_memory() > KEPT_MEMORY:
        forget()


def _resident_memory() -> float:
    """Bytes of memory that this process holds now; zero where the system does not tell."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except (OSError, ValueError, IndexError):
        return 0.0
    return pages * float(os.sysconf("SC_PAGE_SIZE"))
