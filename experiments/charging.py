"""What a gradient is charged, in evaluations of the objective: the ratio of their measured times."""

from __future__ import annotations

import time
from typing import Any

import jax
import numpy as np

from jffsr.compiling import program
from jffsr.optimizers.interface import sample_box
from jffsr.parallel.devices import all_devices
from jffsr.parallel.mapping import evaluate
from jffsr.planning.problem import Problem

_TURNS = 61


def gradient_charge(problem: Problem, members: int, starts: int) -> float:
    """Time of a gradient over that of an objective, a candidate each.

    In the batches that a search uses: so many members of a swarm, so many starts of a descent, over all cores.
    """
    many = np.asarray(sample_box(jax.random.key(0), problem, members))
    few = np.asarray(sample_box(jax.random.key(1), problem, starts))
    seconds: dict[Any, list[float]] = {_values: [], _gradients: []}
    with all_devices():
        jax.block_until_ready((_values(problem, many), _gradients(problem, few)))  # compiles
        for _ in range(_TURNS):  # in turn, so that a load on the machine meets both
            for function, points in ((_values, many), (_gradients, few)):
                started = time.perf_counter()
                jax.block_until_ready(function(problem, points))
                seconds[function].append((time.perf_counter() - started) / len(points))
    return round(float(np.median(seconds[_gradients]) / np.median(seconds[_values])), 3)


@program()
def _values(problem: Problem, points):
    return evaluate(problem.value, points)


@program()
def _gradients(problem: Problem, points):
    return evaluate(jax.value_and_grad(problem.smooth_and_value, has_aux=True), points)
