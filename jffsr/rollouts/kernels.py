"""Which code finds the joint terms of a rollout: `fast`, the hot path, or `plain`, the textbook's."""

from __future__ import annotations

from jffsr.errors import InputError
from jffsr.reading.did_you_mean import hint

FAST, PLAIN = "fast", "plain"
KERNELS = (FAST, PLAIN)


def check_kernel(kernel: str) -> str:
    """The name, if it is one; InputError otherwise."""
    if kernel not in KERNELS:
        raise InputError(
            f"kernel is {kernel!r}; allowed are {', '.join(KERNELS)}{hint(str(kernel), KERNELS)}"
        )
    return kernel
