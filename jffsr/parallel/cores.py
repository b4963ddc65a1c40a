"""One JAX device for each processor core: on a CPU, XLA's own threads speed a batch of small programs up by little."""

from __future__ import annotations

import os

import jax

from jffsr.errors import InputError

_FLAG = "xla_force_host_platform_device_count"


def use_all_cores() -> int:
    """Give JAX one CPU device for each core that this process may use, and return how many there will be.

    To be called before JAX is first used. A number that the user has set wins: JAX_NUM_CPU_DEVICES,
    `jax_num_cpu_devices`, or XLA_FLAGS=--xla_force_host_platform_device_count. Raises InputError where JAX already
    runs with fewer devices.
    """
    cores = available_cores()
    if _FLAG in os.environ.get("XLA_FLAGS", ""):
        return len(jax.local_devices(backend="cpu"))
    if jax.config.jax_num_cpu_devices > 0:
        return jax.config.jax_num_cpu_devices
    try:
        jax.config.update("jax_num_cpu_devices", cores)
    except RuntimeError:
        running = len(jax.local_devices(backend="cpu"))
        if running < cores:
            raise InputError(
                f"JAX already runs with {running} CPU device{'s' if running > 1 else ''}; call "
                f"jffsr.use_all_cores() before anything is computed, so that it can have {cores}"
            ) from None
        return running
    return cores


def available_cores() -> int:
    """The number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
