"""Freed memory, given back to the system: glibc keeps what thousands of small pieces of programs leave behind."""

from __future__ import annotations

import ctypes


def give_back() -> bool:
    """Give freed memory back to the system; whether any was, and False where the C library cannot."""
    # Windows has no library of that name, macOS and musl no such function.
    try:
        trim = ctypes.CDLL(None).malloc_trim
    except (OSError, TypeError, AttributeError):
        return False
    return bool(trim(ctypes.c_size_t(0)))
