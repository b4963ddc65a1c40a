"""What became of a chain: a code, and a sentence that says what to do."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum


class ChainCode(IntEnum):
    """0 is the only success; the others name the stage at which it ended."""

    HELD = 0
    NOT_PLANNED = 1
    TOUCHED = 2
    GRASP_MISSED = 3
    NOT_HELD = 4


@dataclass(frozen=True)
class ChainResult:
    """A code and a sentence of advice."""

    code: ChainCode
    sentence: str

    @property
    def success(self) -> bool:
        """Whether the target was grasped and the base held still."""
        return self.code is ChainCode.HELD
