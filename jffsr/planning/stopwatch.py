"""Where the time of a run went: compiling or running."""

from __future__ import annotations

import threading
import time
from types import TracebackType

import jax.monitoring

from jffsr.compiling.program import is_waiting, seconds_waited

# Small programs outside of the package's own. Their tracing is left out of the sum: JAX reports the traces of inner
# functions again within the outer one's.
_COMPILING = (
    "/jax/core/compile/jaxpr_to_mlir_module_duration",
    "/jax/core/compile/backend_compile_duration",
)
_small = threading.local()


def _listen(event: str, duration: float, **_: object) -> None:
    if event in _COMPILING and not is_waiting():
        _small.seconds = getattr(_small, "seconds", 0.0) + duration


jax.monitoring.register_event_duration_secs_listener(_listen)


def _compiled() -> float:
    return seconds_waited() + getattr(_small, "seconds", 0.0)


class Stopwatch:
    """Context manager; afterwards `total`, `compile` and `run`, s.

    compile is what compilation added to the run: the time in which this thread traced, compiled or loaded
    programs or waited for threads at it. What those threads do while this one runs something adds nothing.
    """

    def __enter__(self) -> Stopwatch:
        self._start, self._compiled = time.perf_counter(), _compiled()
        return self

    def __exit__(self, kind: type | None, value: BaseException | None, trace: TracebackType | None) -> None:
        self.total = time.perf_counter() - self._start
        self.compile = _compiled() - self._compiled
        self.run = max(0.0, self.total - self.compile)

    def as_dict(self) -> dict[str, float]:
        """For summaries."""
        return {"compile": self.compile, "run": self.run, "total": self.total}
