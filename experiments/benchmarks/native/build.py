"""Compiles the C++ opponents for this machine, once for each set of options, and loads them."""

from __future__ import annotations

import ctypes
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

SOURCES = Path(__file__).parent
FLAGS = ("-std=c++17", "-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math", "-DNDEBUG")
LINK = ("-fPIC", "-shared", "-pthread")


class NoCompiler(ImportError):
    """There is no C++ compiler, or it does not accept the source."""


def library(source: str, *options: str, folder: Path | None = None) -> tuple[ctypes.CDLL, float]:
    """The compiled source as a library, and the seconds that compiling took (0 if it was there)."""
    compiler = shutil.which(os.environ.get("CXX", "g++"))
    if compiler is None:
        raise NoCompiler("no C++ compiler found (set CXX)")
    folder = folder or Path(tempfile.gettempdir()) / f"jffsr-benchmarks-{os.getuid()}"
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    command = [compiler, *FLAGS, *LINK, *options, str(SOURCES / source)]
    name = hashlib.sha256(" ".join([*command, sys.version, with_headers(source)]).encode()).hexdigest()[:16]
    target, seconds = folder / f"{Path(source).stem}-{name}.so", 0.0
    if not target.exists():
        started = time.perf_counter()
        part = target.with_suffix(f".{os.getpid()}.part")
        run = subprocess.run([*command, "-o", str(part)], capture_output=True, text=True, check=False)
        if run.returncode:
            raise NoCompiler(f"{source} does not compile: {first_error(run.stderr)}")
        os.replace(part, target)
        seconds = time.perf_counter() - started
    return ctypes.CDLL(str(target)), seconds


def with_headers(source: str) -> str:
    """The text of a source and of the headers here that it includes."""
    text = (SOURCES / source).read_text(encoding="utf-8")
    return text + "".join(with_headers(name) for name in re.findall(r'#include "(.+)"', text))


def first_error(output: str) -> str:
    """The first line of a compiler's output that speaks of an error, without the file's folder."""
    lines = [line for line in output.splitlines() if "error" in line] or output.splitlines() or ["no message"]
    return lines[0].replace(str(SOURCES) + os.sep, "")


def pointer(array: np.ndarray) -> ctypes.c_void_p:
    """The address of a contiguous float64 array."""
    assert array.dtype == np.float64
    assert array.flags.c_contiguous
    return ctypes.c_void_p(array.ctypes.data)
