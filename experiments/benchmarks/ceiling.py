"""The machine's floating-point peak: fused multiply-adds in registers and nothing else."""

from __future__ import annotations

import ctypes
import time

import numpy as np

from experiments.benchmarks.native.build import library, pointer


def peak(threads: int, seconds: float = 0.3) -> float:
    """Most float64 operations per second that this many threads reach, of several trials."""
    code, _ = library("peak.cpp")
    code.multiply_adds.restype = ctypes.c_double
    sink = np.array([0.999999, 1e-7, *np.zeros(threads)])
    best, rounds = 0.0, 100_000
    while True:
        started = time.perf_counter()
        done = code.multiply_adds(ctypes.c_long(rounds), threads, pointer(sink))
        taken = time.perf_counter() - started
        best = max(best, done / taken)
        if taken > seconds:
            return best
        rounds *= 2
