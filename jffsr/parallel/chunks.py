"""How many candidates are evaluated at once on one device.

On a CPU a batch is fastest while what it works on stays near the core. In a trial (512 indices of a seven-axis arm over
200 steps, 0.22 MB each, a core with 1 MiB of second-level cache) chunks of 8 took 29 ms, of 16 33 ms, of 32 36 ms; of
256 more than twice as long. On an accelerator many have to be under way at once, and memory is the limit.
"""

from __future__ import annotations

import math

import jax

CPU_BYTES = 2 * 2**20
"""Default limit on a CPU: twice a core's second-level cache, since the compiler keeps less alive than the jaxpr has."""
CPU_WHOLE = 4
"""A batch of up to so many times that limit is not divided: the loop would cost what the nearer memory saves."""
LANES = 8
"""Candidates that fill a vector register on a CPU; with fewer at once the rest of it would be idle."""
MEMORY_SHARE = 0.25
"""Default limit on other devices: this share of the device's memory."""
UNKNOWN_BYTES = 2 * 2**30
"""The limit where a device does not tell its memory."""


def chunk_size(count: int, item_bytes: int, memory: int | None = None) -> int:
    """Candidates at a time, of `count` that need `item_bytes` each, so that they keep to `memory` bytes.

    At least one; the chunks of a batch are made alike in size. Without `memory`, the default of the kind of device,
    on a CPU in whole vector registers.
    """
    device = jax.local_devices()[0]
    if memory is None and device.platform == "cpu":
        if count * item_bytes <= CPU_WHOLE * CPU_BYTES:
            return count
        largest = max(LANES, CPU_BYTES // item_bytes // LANES * LANES)
    else:
        largest = max(1, int(memory or _share(device)) // max(1, item_bytes))
    return math.ceil(count / math.ceil(count / largest))


def _share(device: jax.Device) -> int:
    known = (device.memory_stats() or {}).get("bytes_limit")
    return int(MEMORY_SHARE * known) if known else UNKNOWN_BYTES
