"""The nearest right name for a wrong one."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def nearest(name: str, candidates: Iterable[str], count: int = 1) -> list[str]:
    """Up to `count` of the candidates that look most like `name`, best first; empty when none is close."""
    by_folded = {candidate.casefold(): candidate for candidate in candidates}
    matches = difflib.get_close_matches(name.casefold()[:200], list(by_folded), n=count, cutoff=0.6)
    # What is cut short looks little like the whole: `poly` for `polynomial`.
    matches += [long for long in by_folded if len(name) > 2 and long.startswith(name.casefold())]
    return [by_folded[match] for match in dict.fromkeys(matches)][:count]


def hint(name: str, candidates: Iterable[str]) -> str:
    """`; did you mean 'x'?` for the nearest candidate, or an empty text when none is close."""
    matches = nearest(name, candidates)
    return f"; did you mean '{matches[0]}'?" if matches else ""


def listed(names: Iterable[str], last: str = "or") -> str:
    """Names as a phrase: `a`, `a or b`, `a, b or c`."""
    names = list(names)
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} {last} {names[-1]}"
