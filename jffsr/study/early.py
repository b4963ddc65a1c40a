"""Importing beside other work what a study needs at its end: XLA leaves the interpreter free while it compiles."""

from __future__ import annotations

import importlib
import threading

_DATA = ("xarray", "h5netcdf")
_FIGURES = ("matplotlib.backends.backend_agg", "jffsr.viz.run")


def import_early(figures: bool) -> threading.Thread:
    """Import the libraries of result.nc, and of the figures, in a thread; the imports proper wait for it."""
    thread = threading.Thread(target=_import, args=(_DATA + (_FIGURES if figures else ()),))
    thread.start()
    return thread


def _import(modules: tuple[str, ...]) -> None:
    for module in modules:
        try:
            importlib.import_module(module)
        except Exception:
            # Whoever needs it will meet the same, and tell.
            return
