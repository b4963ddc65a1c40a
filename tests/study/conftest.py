"""Budgets so small that a whole study compiles and runs in moments; shared by the tests of this folder."""

from __future__ import annotations

import pytest

SMALL = (
    "rollout.num_steps=8",
    "verification.step_factor=2",
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


@pytest.fixture(scope="session")
def small() -> list[str]:
    """Overrides that cut every budget; runs under them share their compiled programs."""
    return list(SMALL)
