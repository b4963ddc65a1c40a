"""Many captures at once: every problem is tried from one start after another until its constraints are kept.

A program takes a few Levenberg-Marquardt steps (`optimizers.restoration`) on a fixed number of lanes, each a problem
and a start of its own. Between two calls the host takes out the lanes that are through, solved or stuck, and puts the
next attempts in: no lane waits for the slowest, and one program does for any number of problems.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.compiling import program
from jffsr.errors import InputError
from jffsr.optimizers.gradient import select
from jffsr.optimizers.interface import Population
from jffsr.optimizers.restoration import Restoration, RestorationState
from jffsr.parallel.devices import all_devices
from jffsr.parallel.mapping import spread
from jffsr.planning.problem import Problem
from jffsr.robots.stacking import first_unlike, stacked
from jffsr.types import Array

_STEPS = 6
"""Steps between two looks: enough that the look costs nothing, few enough that no lane idles for long."""

_LANES = 32

_AT_ONCE = 2
"""Lanes evaluated together on a core: the derivatives of more leave its cache."""


@dataclass(frozen=True)
class Restored:
    """What became of each problem: whether its constraints are kept, and by which free numbers.

    kept (K,); free (K, k), where none is kept those of the last start; attempts (K,), starts tried; jacobians (K,),
    derivatives of the constraints spent on it.
    """

    kept: np.ndarray
    free: np.ndarray
    attempts: np.ndarray
    jacobians: np.ndarray


@program(static_argnums=())
def _begin(problems: Problem, points: Array, method: Restoration) -> RestorationState:
    def one(item):
        problem, point = item
        population = Population(point[None], np.full(1, np.inf))
        return method.init(jax.random.key(0), problem, population)

    return spread(one, (problems, points), chunk=len(points), together=True)


@program(static_argnums=())
def _go_on(problems: Problem, states: RestorationState, method: Restoration) -> RestorationState:
    def one(item):
        problem, state = item

        def step(state, _):
            following = method.step(problem, state)
            ended = state.progress.converged
            return jax.tree.map(lambda old, new: jnp.where(ended, old, new), state, following), None

        return jax.lax.scan(step, state, length=_STEPS)[0]

    return spread(one, (problems, states), chunk=_AT_ONCE, together=True)


def restore_many(
    problems: Sequence[Problem],
    starts: np.ndarray,
    *,
    task_of: Sequence[int] | None = None,
    lanes: int | None = None,
    most_steps: int = 60,
    method: Restoration | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> Restored:
    """Free numbers that keep the constraints of each problem, from the starts (K, s, k) in their order.

    Problems of one structure. Where task_of names for each the task it is a variant of, the others of a task are left
    alone once one is solved; the first start of each variant comes before all second starts. lanes run at once, by
    default as many as there are starts, 32 at most; a number given is kept, so that one program does for fewer. A start
    is given up after most_steps. With more lanes than tasks several starts of a task run side by side, and the
    first to succeed is taken. on_progress is told how many tasks are solved and how many are open. Raises
    InputError for problems or starts that do not go together.
    """
    problems, starts = list(problems), np.asarray(starts, dtype=float)
    if not problems:
        raise InputError("no problem was given")
    other = first_unlike(problems)
    if other is not None:
        raise InputError(f"problem {other} differs from problem 0 in more than numbers; plan it apart")
    count = len(problems)
    size = np.size(problems[0].bounds()[0])
    if starts.ndim != 3 or starts.shape[0] != count or starts.shape[2] != size or not starts.shape[1]:
        raise InputError(f"starts have the shape {starts.shape}; ({count}, s, {size}) is expected")
    tasks = np.arange(count) if task_of is None else np.asarray(task_of)
    every = stacked(problems)
    work = _Work(starts, tasks)
    method = method or Restoration(starts=1)
    lanes = min(_LANES, count * starts.shape[1]) if lanes is None else lanes
    problem_of = np.full(lanes, -1)
    point = np.zeros((lanes, size))
    states, spent = None, np.zeros(lanes, dtype=int)
    while True:
        fresh = np.zeros(lanes, dtype=bool)
        for lane in np.flatnonzero(problem_of < 0):
            attempt = work.next()
            if attempt is None:
                break
            problem_of[lane], point[lane], fresh[lane], spent[lane] = *attempt, True, 0
        if np.all(problem_of < 0):
            return work.found()
        chosen = np.maximum(problem_of, 0)
        batch = jax.tree.map(lambda leaf, chosen=chosen: leaf[chosen], every)
        with all_devices():
            if np.any(fresh):
                begun = _begin(batch, point, method)
                states = begun if states is None else _exchanged(states, begun, fresh)
            states = _go_on(batch, states, method)
            trials, progress = jax.device_get((states.trials, states.progress))
        spent += _STEPS
        for lane in np.flatnonzero(problem_of >= 0):
            number = int(problem_of[lane])
            over = not trials.active[lane, 0] or spent[lane] >= most_steps
            if work.is_solved(number) or over:
                kept = bool(trials.kept[lane, 0])
                work.done(number, kept, trials.point[lane, 0], int(progress.gradient_evaluations[lane]))
                problem_of[lane] = -1
        if on_progress is not None:
            on_progress(*work.counts())


@jax.jit
def _exchanged(states: RestorationState, begun: RestorationState, fresh: Array) -> RestorationState:
    """The states with those of fresh lanes exchanged for ones that begin."""
    return select(fresh, begun, states)


class _Work:
    """The attempts that are still to be made, first starts first, and what became of those that were."""

    def __init__(self, starts: np.ndarray, tasks: np.ndarray):
        count, each, _ = starts.shape
        self._starts, self._tasks = starts, tasks
        variant = np.array([np.sum(tasks[:k] == task) for k, task in enumerate(tasks)])
        order = np.argsort(variant, kind="stable")
        self._queue = deque((int(problem), start) for start in range(each) for problem in order)
        self._solved: set[int] = set()
        self._kept = np.zeros(count, dtype=bool)
        self._free = starts[:, -1].copy()
        self._attempts, self._jacobians = np.zeros(count, dtype=int), np.zeros(count, dtype=int)

    def next(self) -> tuple[int, np.ndarray] | None:
        while self._queue:
            problem, start = self._queue.popleft()
            if not self.is_solved(problem):
                return problem, self._starts[problem, start]
        return None

    def is_solved(self, problem: int) -> bool:
        return int(self._tasks[problem]) in self._solved

    def done(self, problem: int, kept: bool, free: np.ndarray, jacobians: int) -> None:
        self._attempts[problem] += 1
        self._jacobians[problem] += jacobians
        if kept and not self._kept[problem]:
            self._kept[problem], self._free[problem] = True, free
            self._solved.add(int(self._tasks[problem]))
        elif not self._kept[problem]:
            self._free[problem] = free

    def counts(self) -> tuple[int, int]:
        return len(self._solved), len(set(self._tasks.tolist())) - len(self._solved)

    def found(self) -> Restored:
        return Restored(self._kept, self._free, self._attempts, self._jacobians)
