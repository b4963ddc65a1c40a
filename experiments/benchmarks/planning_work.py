"""A planner's own work: the index of a batch of candidates, its gradients, and a whole generation of the swarm."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import jax
import numpy as np

import jffsr
from experiments.benchmarks.cases import Case
from experiments.benchmarks.opponents.jffsr_fast import in_chunks
from experiments.benchmarks.opponents.program import Program, called, compiled
from experiments.benchmarks.opponents.registry import FAST, PLAIN
from jffsr.compiling import jit
from jffsr.optimizers.qpso import QPSO
from jffsr.parallel.devices import all_devices
from jffsr.planning.problem import Problem
from jffsr.pytrees import register_dataclass
from jffsr.study.building import build_problem
from jffsr.study.config import load_config

VALUE, INDEX_GRADIENT, GENERATION = "index", "index and gradient", "generation"
SCENARIO = "composite_7dof"


@register_dataclass
@dataclass(frozen=True, eq=False)
class PlainProblem(Problem):
    """The same problem, its motion by the plain path."""

    def motion(self, candidate):
        """The motion under the free numbers (k,), by `jffsr.reference_rollout`."""
        trajectory = self.trajectory.with_free(candidate)
        return jffsr.reference_rollout(
            self.robot, trajectory, self.initial_state, num_steps=self.num_steps, momentum=self.momentum
        )


def problem_of(case: Case) -> Problem:
    """The scenario's problem with the steps of the case."""
    return replace(build_problem(load_config(SCENARIO)), num_steps=case.steps)


def fast(work: str, case: Case) -> Program:
    """The work as the package does it: chunks, all devices."""
    problem = problem_of(case)
    if work == GENERATION:
        return _generation(problem, case.batch)
    one = problem.smooth_and_value if work == VALUE else _gradient(problem)
    return called(lambda batch: in_chunks(one, batch), _candidates(problem, case.batch), batch=case.batch)


def plain(work: str, case: Case) -> Program:
    """The same by the plain path, one vmap."""
    problem = problem_of(case)
    slow = PlainProblem(**{name: getattr(problem, name) for name in problem.__dataclass_fields__})
    if work == GENERATION:
        return _generation(slow, case.batch)
    few = case.batch if work == VALUE else max(1, case.batch // 4)
    one = slow.smooth_and_value if work == VALUE else _gradient(slow)
    return compiled(jax.vmap(one), _candidates(problem, few), batch=few)


PLANNING_WORK = {
    work: {FAST: partial(fast, work), PLAIN: partial(plain, work)}
    for work in (VALUE, INDEX_GRADIENT, GENERATION)
}


def _gradient(problem: Problem):
    return jax.value_and_grad(problem.smooth_and_value, has_aux=True)


def _candidates(problem: Problem, batch: int) -> np.ndarray:
    lower, upper = (np.asarray(bound) for bound in problem.bounds())
    return np.random.default_rng(0).uniform(0.3 * lower, 0.3 * upper, (batch, lower.size))


def _generation(problem: Problem, particles: int) -> Program:
    swarm = QPSO(iterations=1000.0, particles=particles)
    state = swarm.init(jax.random.key(0), problem)
    step = jit(lambda state: swarm.step(problem, state))

    def run(state):
        with all_devices():
            return step(state)

    return called(run, state, batch=particles)
