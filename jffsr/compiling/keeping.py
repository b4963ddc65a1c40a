"""Where compiled programs are kept between processes, and how much of them.

Two kinds lie there: the package's own programs whole (`jffsr.compiling.store`), and in JAX's persistent cache
whatever else `jax.jit` compiles. Entries of both carry the versions and the machine in their names, so that another
JAX or another processor finds none of them. Entry points call `keep_programs`; importing the package does not.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

import jax

from jffsr.compiling.store import open_store

LIMIT = 256 * 2**20
"""Bytes that a folder may hold at the start of a process; beyond, what was not used for longest is deleted."""

OFF = "off"


def keep_programs() -> Path | None:
    """Keep compiled programs in the folder that the surroundings name; None where nothing is kept.

    JFFSR_CACHE_DIR names the folder, or says off; else JAX_COMPILATION_CACHE_DIR; else it is jffsr in the
    user's cache folder. JAX_ENABLE_COMPILATION_CACHE=0 also says off. A folder that cannot be written is said
    on the standard error, and nothing is kept.
    """
    chosen = os.environ.get("JFFSR_CACHE_DIR") or os.environ.get("JAX_COMPILATION_CACHE_DIR")
    folder = None
    if chosen != OFF and jax.config.jax_enable_compilation_cache:
        folder = _writable(Path(chosen) if chosen else _user_folder())
    jax.config.update("jax_compilation_cache_dir", None if folder is None else str(folder))
    if folder is not None:
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
        jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
        shorten(folder, LIMIT)
    open_store(folder)
    return folder


def _user_folder() -> Path | None:
    """jffsr in the platform's folder for caches; None where the user has no home."""
    if sys.platform == "win32":
        place = os.environ.get("LOCALAPPDATA")
    else:
        place = os.environ.get("XDG_CACHE_HOME")
    if place:
        return Path(place) / "jffsr"
    try:
        home = Path.home()
    except RuntimeError:
        return None
    return home / ("Library/Caches" if sys.platform == "darwin" else ".cache") / "jffsr"


def _writable(folder: Path | None) -> Path | None:
    """The folder, made where it is missing, if a file can be written into it."""
    if folder is None:
        return None
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder.absolute()
    except OSError as error:
        print(
            f"jffsr: compiled programs are not kept: {folder} cannot be written ({error.strerror or error})",
            file=sys.stderr,
        )
        return None


def shorten(folder: Path, limit: int) -> None:
    """Delete the files of a folder that were not used for longest until the rest has at most `limit` bytes."""
    files = []
    with os.scandir(folder) as entries:
        for entry in entries:
            # Another process may delete at the same time.
            try:
                if entry.is_file(follow_symlinks=False):
                    found = entry.stat(follow_symlinks=False)
                    files.append((max(found.st_atime, found.st_mtime), found.st_size, entry.path))
            except FileNotFoundError:
                continue
    total = sum(size for _, size, _ in files)
    for _, size, path in sorted(files):
        if total <= limit:
            return
        try:
            os.unlink(path)
        except OSError:
            continue
        total -= size
