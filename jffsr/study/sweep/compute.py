"""One task of a sweep computed: the same in this process, in another, and on another machine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import jax
import numpy as np

from jffsr.optimizers.constraints import split
from jffsr.planning.many import PlanHistory, Plans, plan_many
from jffsr.planning.plan import Plan, solve
from jffsr.study.sweep.misses import misses_of
from jffsr.study.sweep.tasks import Task

STEPS_KEPT = 200
"""Steps of each search that are kept, spread evenly over it, its last one among them."""
OVERRUN = "overrun_"
"""What the names of the limits' overruns begin with."""

Results = dict[str, np.ndarray]


def run_task(task: Task) -> Results:
    """Plan the points of a task; arrays with a leading axis over them, under the names of the merged file."""
    if task.width is None:
        with jax.enable_x64(task.settings[0].precision == "float64"):
            plans = _alone(task)
        return _results(plans, task, task.settings[0].precision)
    with jax.enable_x64(True):
        # A task of which something is done already is filled up, so that it is the same program.
        settings, seeds = (_filled(values, task.width) for values in (task.settings, task.seeds))
        one = settings[0]
        same = all(setting.settings == one.settings for setting in settings)
        plans = plan_many(
            [setting.problem for setting in settings],
            one.optimizer,
            one.settings if same else [setting.settings for setting in settings],
            seeds=seeds,
            step_factor=one.step_factor,
            tolerances=one.tolerances,
            with_history=True,
        )
    count = len(task.numbers)
    return _results(jax.tree.map(lambda leaf: leaf[:count], plans), task)


def _filled(values: Sequence[Any], width: int) -> list[Any]:
    return [*values, *[values[-1]] * (width - len(values))]


def _alone(task: Task) -> Plans:
    """One point by the driver, as a batch of one."""
    setting = task.settings[0]
    found: Plan = solve(
        setting.problem,
        setting.optimizer,
        setting.settings,
        seed=task.seeds[0],
        step_factor=setting.step_factor,
        tolerances=setting.tolerances,
        precision=setting.precision,
        with_sensitivity=False,
    )
    history = np.array(found.history, dtype=float).reshape(-1, 5)
    plans = Plans(
        result=np.int32(found.result.code),
        cost=np.float64(found.cost),
        free=found.free,
        motion=found.motion,
        verification=found.verification,
        evaluations=np.int64(found.evaluations),
        gradient_evaluations=np.int64(found.gradient_evaluations),
        history=PlanHistory(history[:, 4], history[:, 2].astype(int), history[:, 3].astype(int)),
    )
    return jax.tree.map(lambda leaf: np.asarray(leaf)[None], plans)


def _results(plans: Plans, task: Task, precision: str = "float64") -> Results:
    check, history = plans.verification, plans.history
    names = sorted(check.terms)
    kept = _kept(history.best_value.shape[1])
    # Under constraints the search compares merits; a value counts from where all constraints are kept.
    best = split(history.best_value, precision)[0] if check.violations else history.best_value
    missed = [np.asarray(values) for values in check.violations.values()]
    return {
        "code": plans.result,
        "cost": plans.cost,
        "evaluations": plans.evaluations,
        "gradient_evaluations": plans.gradient_evaluations,
        "duration": plans.motion.time[:, -1],
        "free_numbers": plans.free,
        "cost_finer": check.cost,
        "attitude_difference": check.attitude_difference,
        "position_difference": check.position_difference,
        "boundary_error": check.boundary_error,
        "momentum_drift": check.momentum_drift,
        "violation": np.max(missed, axis=0) if missed else np.zeros(len(plans.cost)),
        **misses_of([setting.problem for setting in task.settings], check.violations),
        **{
            f"{OVERRUN}{kind}": np.max(values, axis=-1, initial=-np.inf)
            for kind, values in vars(check.overruns).items()
        },
        "terms": np.array(names),
        "term_value": np.stack([check.terms[name].value for name in names], axis=-1),
        "term_weighted": np.stack([check.terms[name].weighted for name in names], axis=-1),
        "history_best_value": best[:, kept],
        "history_evaluations": history.evaluations[:, kept],
        "history_gradient_evaluations": history.gradient_evaluations[:, kept],
    }


def _kept(steps: int) -> np.ndarray:
    if steps <= STEPS_KEPT:
        return np.arange(steps)
    return np.linspace(0, steps - 1, STEPS_KEPT).round().astype(int)
