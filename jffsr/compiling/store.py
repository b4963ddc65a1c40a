"""The folder of kept programs: compiled forms under the names of everything that they depend on.

Nothing here can make a run fail: a file that cannot be read is as good as none, one that cannot be written is left
out. The folder is bounded; whoever opens it drops what was not used for longest.
"""

from __future__ import annotations

import logging
import os
import pickle
import secrets
import threading
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import jax
import jax.monitoring
import jax.numpy as jnp
from jax.experimental import serialize_executable
from jax.sharding import Mesh

from jffsr.compiling.naming import Unnamed, digest

_logger = logging.getLogger(__name__)
_SUFFIX = ".program"
_INERT = "xla_gpu_nccl_termination_timeout_seconds"
_folder: Path | None = None
_loaded_by_jax = threading.local()


def open_store(folder: Path | None) -> None:
    """Keep programs in a folder that exists from now on, or, with None, nowhere."""
    global _folder
    _folder = folder


def name_of(
    function: Callable, options: dict, static: list[Any], dynamic: list[Any], mesh: Mesh
) -> str | None:
    """The name of a program's compiled form; None where it is not kept.

    Not kept are programs that hold what is not the package's own, such as a user's function, whose text may
    change under the same name.
    """
    if _folder is None or jax.default_backend() != "cpu":
        return None
    try:
        return digest(function, options, static, dynamic, mesh)
    except Unnamed as error:
        _logger.debug("%s is not kept: %s", function.__qualname__, error)
        return None


def load(name: str, mesh: Mesh) -> Callable[..., Any] | None:
    """The compiled form under a name, ready to be called; None where there is none that can be read."""
    devices = jax.local_devices()[:1] if mesh.empty else list(mesh.devices.flat)
    path = _path(name)
    try:
        calls_lapack, *parts = pickle.loads(zlib.decompress(path.read_bytes()))
        if calls_lapack:
            _find_lapack()
        executable = serialize_executable.deserialize_and_load(*parts, execution_devices=devices)
        os.utime(path)
    except FileNotFoundError:
        return None
    except Exception as error:
        _logger.debug("%s cannot be read: %s", path, error)
        return None
    return executable


def compile_and_save(name: str, lowered: jax.stages.Lowered, options: dict) -> Callable[..., Any]:
    """Compile, and keep the compiled form under a name."""
    _loaded_by_jax.flag = False
    executable = lowered.compile()
    if _loaded_by_jax.flag:
        # What JAX's own cache has loaded cannot be written out again: XLA keeps its object code no longer. An
        # option that means nothing here, of a value that no one has set before, makes JAX compile.
        _loaded_by_jax.flag = False
        executable = lowered.compile(compiler_options={**options, _INERT: -2 - secrets.randbelow(2**30)})
        if _loaded_by_jax.flag:
            return executable
    try:
        parts = ("lapack" in lowered.as_text(), *serialize_executable.serialize(executable))
        _write(_path(name), zlib.compress(pickle.dumps(parts), level=1))
    except Exception as error:
        _logger.debug("%s is not kept: %s", name, error)
    return executable


@cache
def _find_lapack() -> None:
    """Have JAX look up LAPACK, which it does when it lowers a call of it; programs loaded here were lowered before."""
    one = jax.ShapeDtypeStruct((1, 1), "float32")
    jax.jit(jnp.linalg.solve).lower(one, one)


def _path(name: str) -> Path:
    return _folder / f"{name}{_SUFFIX}"


def _write(path: Path, content: bytes) -> None:
    part = path.with_name(f".{path.name}.{os.getpid()}.{threading.get_ident()}.part")
    try:
        part.write_bytes(content)
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def _listen(event: str, **_: object) -> None:
    if event == "/jax/compilation_cache/cache_hits":
        _loaded_by_jax.flag = True


jax.monitoring.register_event_listener(_listen)
