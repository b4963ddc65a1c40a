"""A search whose progress is kept in its run folder: metrics, checkpoint, progress bar, interrupt."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import jax

from jffsr.optimizers.constraints import split
from jffsr.optimizers.driver import Phase, Snapshot
from jffsr.optimizers.interface import OptimizationProblem
from jffsr.parallel.processes import any_process, is_first
from jffsr.study.checkpoint import load_checkpoint, save_checkpoint
from jffsr.study.interrupt import Interrupt
from jffsr.study.progress import progress_bar
from jffsr.study.run_folder import RunFolder


@contextmanager
def kept_search(
    folder: RunFolder,
    begun: bool,
    phases: list[Phase],
    searched: OptimizationProblem,
    *,
    seed: int,
    progress: bool,
    constrained: bool = False,
    say: Callable[[str], None] = lambda text: None,
) -> Iterator[dict[str, Any]]:
    """The driver's arguments `resume`, `on_chunk` and `interrupted` for a search in this folder.

    begun: there is a checkpoint to go on from. Of several processes the first writes and draws the bar.
    """
    resume = None
    if begun:
        resume = load_checkpoint(folder.checkpoint, phases, searched, jax.random.key(seed))
        say(f"going on from {folder.checkpoint} ({resume.history[-1].evaluations} evaluations done)")
    if is_first():
        done = resume.history[-1] if resume else None
        folder.keep_metrics(done.evaluations if done else 0, done.gradient_evaluations if done else 0)
    show, close = progress_bar(phases, progress and is_first(), constrained)

    def on_chunk(snapshot: Snapshot) -> None:
        last = snapshot.history[-1]
        if is_first():
            folder.add_metrics(
                phase=phases[snapshot.phase].name,
                iteration=last.iteration,
                evaluations=last.evaluations,
                gradient_evaluations=last.gradient_evaluations,
                **_best(constrained, last.best_value, snapshot.state.progress.best_position.dtype),
            )
        save_checkpoint(folder.checkpoint, snapshot)
        show(snapshot)

    with Interrupt() as interrupted:
        try:
            yield {
                "resume": resume,
                "on_chunk": on_chunk,
                "interrupted": lambda: any_process(interrupted()),
            }
        finally:
            close()


def _best(constrained: bool, found: float, dtype: Any) -> dict[str, float]:
    """The best index so far, and where there are constraints how far they are missed."""
    if not constrained:
        return {"best_value": found}
    value, violation = split(found, dtype)
    return {"best_value": float(value), "violation": float(violation)}
