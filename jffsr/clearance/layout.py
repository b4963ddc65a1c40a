"""Which solids there are, on which bodies, and which of them are compared: what is static of a clearance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from jffsr.clearance.solids import BOX_CORE, SEGMENT_CORE, Solid
from jffsr.types import Array


class SolidNumbers(NamedTuple):
    """The numbers of all solids, (k, ...), as in `Solid`."""

    centre: Array
    axes: Array
    half: Array
    radius: Array
    slack: Array
    box: Array
    ball: Array
    ellipsoid: Array


class Kind(NamedTuple):
    """What pairs of solids of one kind have in common: their cores, and whether flat ends of either count."""

    first: str
    second: str
    ends: bool


KINDS = tuple(
    Kind(first, second, ends)
    for first, second in ((SEGMENT_CORE, SEGMENT_CORE), (BOX_CORE, SEGMENT_CORE), (BOX_CORE, BOX_CORE))
    for ends in (False, True)
)


@dataclass(frozen=True)
class Layout:
    """Solids on `bodies` (k,), and the pairs of them whose distance is found.

    groups are the kinds that there are, each with its pairs of numbers of solids, a box before a segment; the pairs are
    numbered through in this order. members (p,) are, for each pair of bodies, the numbers of its pairs of solids;
    body_pairs (p,) the numbers of the bodies.
    """

    bodies: tuple[int, ...]
    groups: tuple[tuple[Kind, tuple[tuple[int, int], ...]], ...]
    members: tuple[tuple[int, ...], ...]
    body_pairs: tuple[tuple[int, int], ...]

    @property
    def solid_pairs(self) -> tuple[tuple[int, int], ...]:
        """The pairs of numbers of solids of all groups, in order."""
        return tuple(pair for _, pairs in self.groups for pair in pairs)

    @property
    def nearest_table(self) -> np.ndarray:
        """`members` as a table (p, most), shorter rows filled up with their first."""
        most = max(len(member) for member in self.members)
        return np.array([[*m, *m[:1] * (most - len(m))] for m in self.members])


def lay_out(
    by_body: dict[int, list[Solid]], body_pairs: list[tuple[int, int]]
) -> tuple[Layout, SolidNumbers]:
    """The layout of these pairs of bodies, whose solids are given by the body's number, and the solids' numbers."""
    solids = [solid for found in by_body.values() for solid in found]
    place_of = {id(solid): k for k, solid in enumerate(solids)}
    kinds: dict[Kind, list[tuple[int, int]]] = {kind: [] for kind in KINDS}
    owners: dict[Kind, list[int]] = {kind: [] for kind in KINDS}
    for owner, (one, other) in enumerate(body_pairs):
        for a in by_body[one]:
            for b in by_body[other]:
                first, second = (b, a) if (a.core, b.core) == (SEGMENT_CORE, BOX_CORE) else (a, b)
                kind = Kind(first.core, second.core, first.has_ends or second.has_ends)
                kinds[kind].append((place_of[id(first)], place_of[id(second)]))
                owners[kind].append(owner)
    owner_of = [owner for kind in KINDS for owner in owners[kind]]
    members = [
        tuple(k for k, owner in enumerate(owner_of) if owner == pair) for pair in range(len(body_pairs))
    ]
    numbers = SolidNumbers(
        *(np.array([getattr(s, name) for s in solids], dtype=float) for name in SolidNumbers._fields)
    )
    bodies = tuple(solid.body for solid in solids)
    groups = tuple((kind, tuple(pairs)) for kind, pairs in kinds.items() if pairs)
    return Layout(bodies, groups, tuple(members), tuple(body_pairs)), numbers
