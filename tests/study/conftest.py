"""Budgets so small that a whole study compiles and runs in moments; shared by the tests of this folder."""

from __future__ import annotations

import os

import pytest

SMALL = (
    "rollout.num_steps=8",
    "verification.step_factor=2",
    "verification.sensitivity=false",
    "optimizer.kind=hybrid",
    "optimizer.particles=4",
    "optimizer.swarm_evaluations=16",
    "optimizer.starts=1",
    "optimizer.gradient_iterations=4",
    "optimizer.polish_iterations=2",
    "optimizer.chunk=2",
    "optimizer.method=lbfgs",
    "optimizer.memory=3",
    "output.figures=false",
    "output.progress=false",
)


@pytest.fixture(scope="session", autouse=True)
def compilation_cache(tmp_path_factory):
    """The command line keeps compiled programs: here in a folder of the tests', shared by their workers."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("JFFSR_CACHE_DIR", str(folder / "xla"))
        yield


@pytest.fixture(scope="session")
def small() -> list[str]:
    """Overrides that cut every budget; runs under them share their compiled programs."""
    return list(SMALL)
