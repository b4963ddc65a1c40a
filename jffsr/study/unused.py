"""Notes on keys of an optimizer's section that are given and change nothing."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from operator import attrgetter

from jffsr.optimizers.unused import changed_settings, unused_settings
from jffsr.study.robot_study import RobotStudy


def unused_keys(configs: Iterable[RobotStudy], section: str = "optimizer") -> Iterator[str]:
    """One sentence for each setting of this section that none of the studies uses, with the first place of it."""
    used: set[str] = set()
    places: dict[str, str] = {}
    kinds: dict[str, None] = {}
    looked_at: set[str] = set()
    for config in configs:
        optimizer = attrgetter(section)(config)
        kind, settings = optimizer.kind, optimizer.settings()
        kinds[kind] = None
        if (mark := repr((kind, settings))) in looked_at:
            continue
        looked_at.add(mark)
        idle = unused_settings(kind, settings)
        used.update(set(changed_settings(settings)) - set(idle))
        for key in idle:
            places.setdefault(key, config.where(f"{section}.{key}"))
    by = " and ".join(f"'{kind}'" for kind in kinds) + (" does" if len(kinds) == 1 else " do")
    for key, place in places.items():
        if key not in used:
            yield f"{place}: given, but {by} not use it"
