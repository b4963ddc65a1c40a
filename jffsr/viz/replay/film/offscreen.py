"""Pictures from a process that draws without a window, by whichever of OpenGL's libraries works here."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import jffsr
from jffsr.errors import InputError
from jffsr.viz.replay.film.drawing import READY, Task

LIBRARIES = {"linux": ("egl", "osmesa"), "darwin": ("cgl", "glfw"), "win32": ("glfw",)}
"""What MUJOCO_GL may be to draw without a window on each system, what is tried first coming first."""
_REMEDY = (
    "install an OpenGL library that draws without a window (on Debian and Ubuntu: apt-get install libegl1 "
    "libgl1-mesa-dri, or libosmesa6) and, to choose one, set MUJOCO_GL=egl or MUJOCO_GL=osmesa"
)
_OFF = ("off", "disable", "disabled", "false", "0")


def drawn(task: Task) -> Iterator[np.ndarray]:
    """The pictures (height, width, 3) of a task, as they come; InputError where nothing here can draw them."""
    failures = []
    for library in _libraries():
        with tempfile.TemporaryFile() as errors:
            process = _start(library, errors)
            try:
                # Handed over beside: whoever cannot draw ends without reading on.
                feeder = threading.Thread(target=_feed, args=(process, task), daemon=True)
                feeder.start()
                if process.stdout.read(len(READY)) == READY:
                    yield from _pictures(process, task, library, errors)
                    return
                process.wait()
                failures.append(f"{library}: {_told(errors, process.returncode)}")
            finally:
                process.kill()
                process.wait()
                feeder.join()
                process.stdout.close()
    raise InputError(f"no video can be drawn on this machine ({'; '.join(failures)}): {_REMEDY}")


def _libraries() -> tuple[str, ...]:
    asked = os.environ.get("MUJOCO_GL", "").strip().lower()
    known = LIBRARIES.get(sys.platform, ("glfw",))
    if asked in _OFF:
        raise InputError(f"MUJOCO_GL={asked} forbids drawing; unset it, or set it to {' or '.join(known)}")
    if not asked:
        # A window that is never shown does as well, where there is a screen.
        return (*known, "glfw") if os.environ.get("DISPLAY") and "glfw" not in known else known
    if asked not in (*known, "glfw"):
        allowed = ", ".join(dict.fromkeys((*known, "glfw")))
        raise InputError(f"MUJOCO_GL is '{asked}'; to draw a video it may be {allowed}, or unset")
    return (asked,)


def _start(library: str, errors) -> subprocess.Popen:
    root = str(Path(jffsr.__file__).parents[1])
    places = os.pathsep.join(filter(None, [root, os.environ.get("PYTHONPATH", "")]))
    # A library that this process has loaded says nothing about that one.
    environment = {name: value for name, value in os.environ.items() if name != "PYOPENGL_PLATFORM"}
    return subprocess.Popen(
        [sys.executable, "-m", "jffsr.viz.replay.film.drawing"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=errors,
        env={**environment, "PYTHONPATH": places, "MUJOCO_GL": library},
    )


def _feed(process: subprocess.Popen, task: Task) -> None:
    try:
        with process.stdin as pipe:
            pickle.dump(task, pipe)
    except OSError:
        pass  # it has ended, and has said why


def _pictures(process: subprocess.Popen, task: Task, library: str, errors) -> Iterator[np.ndarray]:
    size = task.width * task.height * 3
    for _ in task.times:
        data = process.stdout.read(size)
        if len(data) < size:
            process.wait()
            told = _told(errors, process.returncode)
            raise InputError(f"drawing the video with MUJOCO_GL={library} ended early ({told}): {_REMEDY}")
        yield np.frombuffer(data, np.uint8).reshape(task.height, task.width, 3)


def _told(errors, status: int) -> str:
    """The last line that the process said, or how it ended."""
    errors.seek(0)
    lines = [line.strip() for line in errors.read().decode(errors="replace").splitlines() if line.strip()]
    if lines:
        return lines[-1].rstrip(".")[:300]
    return f"ended by signal {-status}" if status < 0 else f"ended with status {status}"
