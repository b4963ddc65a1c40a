"""Which bodies can meet: the pairs that a clearance is kept between."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations

from jffsr.errors import InputError
from jffsr.reading.did_you_mean import hint
from jffsr.robots.robot import Topology

TARGET = "target"
"""Name of the free target among the bodies of a clearance."""


def body_pairs(
    topology: Topology, bodies: Iterable[int], ignore: Sequence[tuple[str, str]]
) -> list[tuple[int, int]]:
    """Pairs of body numbers, the smaller first, out of `bodies`, those that have shapes; the target comes last.

    Left out: a body and the one it hangs from, whose shapes overlap at their joint by design, and the pairs of names in
    `ignore`, in either order. Raises InputError for a name in `ignore` that no body has.
    """
    names = body_names(topology)
    left_out = {(parent, joint + 1) for joint, parent in enumerate(topology.parents)}
    for pair in ignore:
        numbers = []
        for name in pair:
            if name not in names:
                raise InputError(
                    f"clearance: ignore: body '{name}' does not exist; there are: {', '.join(names)}"
                    f"{hint(str(name), names)}"
                )
            numbers.append(names.index(name))
        if len(numbers) != 2:
            raise InputError(f"clearance: ignore: {tuple(pair)!r} is no pair of two names of bodies")
        left_out.add((min(numbers), max(numbers)))
    return [pair for pair in combinations(sorted(bodies), 2) if pair not in left_out]


def body_names(topology: Topology) -> tuple[str, ...]:
    """Names of the robot's bodies, then the target's."""
    if TARGET in topology.body_names:
        raise InputError(
            f"clearance: robot '{topology.name}' has a body of the name '{TARGET}', which is the free target's"
        )
    return (*topology.body_names, TARGET)
