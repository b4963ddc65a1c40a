"""How many candidates are evaluated at once on one device.

On a CPU a batch is fastest while what it works on stays near the core: rollouts of a seven-axis arm over 200 steps
(0.23 MB each) run fastest 16 at a time. On an accelerator many have to be under way at once, and memory is the limit.
"""

from __future__ import annotations

import math

import jax

CPU_BYTES = 4 * 2**20
"""Default limit on a CPU: what was fastest where a core has 1 MiB of second-level and a share of third-level cache."""
MEMORY_SHARE = 0.25
"""Default limit on other devices: this share of the device's memory."""
UNKNOWN_BYTES = 2 * 2**30
"""Where a device does not tell its memory."""
LANES = 8
"""Candidates that fill a vector register on a CPU; with fewer at once the rest of it would be idle."""


def chunk_size(count: int, item_bytes: int, memory: int | None = None) -> int:
    """Candidates at a time, at least one, so that `count` of them of `item_bytes` each keep to `memory` bytes.

    The chunks of a batch are made alike in size. Without `memory`, the default of the kind of device; on a CPU
    no fewer than fill a vector register.
    """
    least = 1
    if memory is None:
        memory, least = default_memory()
    largest = max(least, int(memory) // max(1, item_bytes))
    return math.ceil(count / math.ceil(count / largest))


def default_memory() -> tuple[int, int]:
    """The default limit in bytes of one device, and the fewest candidates that are worth a chunk there."""
    device = jax.local_devices()[0]
    if device.platform == "cpu":
        return CPU_BYTES, LANES
    stats = device.memory_stats() or {}
    known = stats.get("bytes_limit")
    return (int(MEMORY_SHARE * known) if known else UNKNOWN_BYTES), 1
