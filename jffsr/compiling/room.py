"""How many memory mappings a process may still make: each compiled program takes hundreds or thousands."""

from __future__ import annotations

from pathlib import Path

MOST = 0.7
"""Share of the allowed mappings above which there is little room."""

_MAPS, _ALLOWED = Path("/proc/self/maps"), Path("/proc/sys/vm/max_map_count")


def mappings_share() -> float:
    """Mappings of this process as a share of those that Linux allows; zero where the system does not tell.

    At one LLVM ends the process: "Unable to allocate section memory", with any amount of memory free.
    """
    try:
        with _MAPS.open("rb") as file:
            used = sum(1 for _ in file)
        return used / int(_ALLOWED.read_text(encoding="ascii"))
    except (OSError, ValueError, ZeroDivisionError):
        return 0.0


def has_little_room() -> bool:
    """Whether the mappings come to an end."""
    return mappings_share() > MOST
