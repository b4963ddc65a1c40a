"""The progress bar of a search, fed from the host between chunks."""

from __future__ import annotations

import math
import shutil
import sys
from collections.abc import Callable

from jffsr.optimizers.constraints import split
from jffsr.optimizers.driver import Phase, Snapshot


def expected_evaluations(phases: list[Phase]) -> int | None:
    """Evaluations and gradients that the phases may use at most; None when nothing bounds them."""
    total = 0.0
    for phase in phases:
        each = getattr(phase.optimizer, "particles", None) or getattr(phase.optimizer, "starts", 1)
        total += float(phase.stop.iterations) * each
    return int(total) if math.isfinite(total) else None


def progress_bar(
    phases: list[Phase], shown: bool, constrained: bool = False
) -> tuple[Callable[[Snapshot], None], Callable[[], None]]:
    """A function that takes snapshots and draws them, and one that closes the bar.

    The bar shows the phase, the best index (or how far constraints are missed), evaluations per second and the time
    left; it is drawn only on a terminal.
    """
    from tqdm import tqdm

    bar = tqdm(
        total=expected_evaluations(phases),
        unit="eval",
        disable=None if shown else True,
        file=sys.stderr,
        # A terminal that does not know its width says 0, and would get an empty bar.
        ncols=shutil.get_terminal_size().columns,
        smoothing=0.1,
    )

    def show(snapshot: Snapshot) -> None:
        last = snapshot.history[-1]
        bar.set_description(phases[snapshot.phase].name, refresh=False)
        bar.set_postfix_str(_best(snapshot, constrained), refresh=False)
        bar.update(last.evaluations + last.gradient_evaluations - bar.n)

    return show, bar.close


def _best(snapshot: Snapshot, constrained: bool) -> str:
    best, missed = snapshot.history[-1].best_value, 0.0
    if constrained:
        best, missed = split(best, snapshot.state.progress.best_position.dtype)
    if missed > 0 and math.isfinite(missed):
        return f"constraints missed by {missed:.2g}"
    return f"best J {best:.4g}" if math.isfinite(best) else "best J none yet"
