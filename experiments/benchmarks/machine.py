"""The machine and the versions, in words that name no host and no path."""

from __future__ import annotations

import os
import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = (
    "jax",
    "jaxlib",
    "numpy",
    "mujoco-mjx",
    "diffrax",
    "frax",
    "adam-robotics",
    "pin",
    "evosax",
    "pygmo",
)


def describe_machine() -> dict:
    """Processor, cores, memory, versions."""
    return {
        "processor": _field("/proc/cpuinfo", "model name") or platform.processor() or "unknown",
        "vectors": _vectors(),
        "cores": len(os.sched_getaffinity(0)),
        "memory_gib": round(_memory() / 2**30, 1),
        "system": platform.system(),
        "python": platform.python_version(),
        "compiler": _compiler(),
        "versions": {name: _version(name) for name in PACKAGES},
    }


def describe_device() -> dict:
    """The device that JAX computes on."""
    import jax

    device = jax.devices()[0]
    return {"platform": device.platform, "device": device.device_kind, "devices": jax.device_count()}


def _field(file: str, key: str) -> str | None:
    try:
        lines = Path(file).read_text(encoding="utf-8").splitlines()
    except OSError:
        return None
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith(key)), None)


def _vectors() -> str:
    flags = (_field("/proc/cpuinfo", "flags") or "").split()
    return next(
        (name for name, flag in (("AVX-512", "avx512f"), ("AVX2", "avx2")) if flag in flags), "unknown"
    )


def _memory() -> int:
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _compiler() -> str | None:
    try:
        run = subprocess.run(
            [os.environ.get("CXX", "g++"), "-dumpfullversion"], capture_output=True, text=True, check=False
        )
    except OSError:
        return None
    return f"g++ {run.stdout.strip()}" if run.returncode == 0 else None
