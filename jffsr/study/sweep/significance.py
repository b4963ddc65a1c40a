"""Whether the costs of one choice are lower than those of another, by tests that only compare ranks.

Two choices: Mann and Whitney's U, exact for few runs without ties. Several: each pair so, and the probabilities
corrected for their number by Holm's step-down ("A simple sequentially rejective multiple test procedure", 1979); and
over settings, Friedman's test on the medians of each, as Demsar recommends ("Statistical comparisons of classifiers
over multiple data sets", 2006).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from jffsr.planning.result import ResultCode
from jffsr.study.sweep.merging import MISSING

MOST_CHOICES = 12
FEWEST_RUNS = 3
_LEVEL = 0.05


@dataclass(frozen=True)
class Pair:
    """Two choices at one setting: medians, how likely a run of the first is the lower one, and probabilities.

    lower is Vargha and Delaney's measure, 0.5 where neither tends to be lower; p is two-sided, holm corrected for all
    pairs of the comparison.
    """

    setting: dict[str, Any]
    first: Any
    second: Any
    medians: tuple[float, float]
    lower: float
    p: float
    holm: float = np.nan


@dataclass(frozen=True)
class Comparison:
    """All pairs of the choices of one key, and Friedman's probability over settings, None where it does not apply."""

    key: str
    pairs: tuple[Pair, ...]
    friedman: float | None

    def to_markdown(self) -> str:
        """A table of the pairs, and one sentence."""
        settings = list(self.pairs[0].setting)
        head = [*settings, "first", "second", "J medians", "P(first is lower)", "p", "p (Holm)", "lower J"]
        lines = [f"Rank tests between values of {self.key} (Mann-Whitney, two-sided, Holm's correction):", ""]
        lines += [f"| {' | '.join(head)} |", f"| {' | '.join(['---'] * len(head))} |"]
        for pair in self.pairs:
            better = pair.first if pair.lower > 0.5 else pair.second
            cells = [
                *(str(value) for value in pair.setting.values()), str(pair.first), str(pair.second),
                f"{pair.medians[0]:.3g}, {pair.medians[1]:.3g}", f"{pair.lower:.2f}", f"{pair.p:.2g}",
                f"{pair.holm:.2g}", str(better) if pair.holm < _LEVEL else "-",
            ]  # fmt: skip
            lines.append(f"| {' | '.join(cells)} |")
        if self.friedman is not None:
            lines += ["", f"Friedman's test over the settings' medians: p = {self.friedman:.2g}."]
        return "\n".join(lines)


def compare(dataset: Any, keys: list[str]) -> list[Comparison]:
    """The comparisons of a merged sweep: between optimizers where swept, else between the values of the only key.

    keys are the swept ones without the seed. There is none where each choice has fewer than three runs.
    """
    candidates = ["optimizer.kind"] if "optimizer.kind" in keys else keys if len(keys) == 1 else []
    found = []
    for key in candidates:
        levels = list(dict.fromkeys(dataset[key].values.tolist()))
        if 2 <= len(levels) <= MOST_CHOICES:
            comparison = _comparison(dataset, key, levels, [other for other in keys if other != key])
            if comparison is not None:
                found.append(comparison)
    return found


def _comparison(dataset: Any, key: str, levels: list[Any], others: list[str]) -> Comparison | None:
    known = dataset["code"].values != MISSING
    cost = ranked_cost(dataset)
    columns = [dataset[other].values for other in others]
    settings = list(dict.fromkeys(zip(*(column.tolist() for column in columns), strict=True))) or [()]
    pairs, medians = [], []
    for values in settings:
        here = known.copy()
        for column, value in zip(columns, values, strict=True):
            here &= column == value
        samples = [cost[here & (dataset[key].values == level)] for level in levels]
        named = dict(zip(others, values, strict=True))
        for (i, first), (j, second) in combinations(enumerate(samples), 2):
            if min(first.size, second.size) >= FEWEST_RUNS:
                pairs.append(_pair(named, levels[i], levels[j], first, second))
        if all(sample.size for sample in samples):
            medians.append([np.median(sample) for sample in samples])
    if not pairs:
        return None
    corrected = holm([pair.p for pair in pairs])
    pairs = [Pair(**{**pair.__dict__, "holm": p}) for pair, p in zip(pairs, corrected, strict=True)]
    return Comparison(key, tuple(pairs), _friedman(np.array(medians)) if len(levels) > 2 else None)


def _pair(setting: dict[str, Any], one: Any, other: Any, first: np.ndarray, second: np.ndarray) -> Pair:
    from scipy.stats import mannwhitneyu

    # Only the order counts, and the test subtracts: infinities are put behind all else by rank.
    ranks = np.unique(np.concatenate([first, second]), return_inverse=True)[1].astype(float)
    a, b = ranks[: first.size], ranks[first.size :]
    if np.all(ranks == ranks[0]):
        p = 1.0
    else:
        p = float(mannwhitneyu(a, b, alternative="two-sided").pvalue)
    below = np.mean((a[:, None] < b) + 0.5 * (a[:, None] == b))
    return Pair(setting, one, other, (float(np.median(first)), float(np.median(second))), float(below), p)


def ranked_cost(dataset: Any) -> np.ndarray:
    """J of every point, infinite where it is not finite or was bought by breaking a constraint."""
    cost, code = dataset["cost"].values, dataset["code"].values
    bad = np.isnan(cost) | (code == ResultCode.CONSTRAINTS_VIOLATED)
    if dataset.sizes.get("step"):
        # A search that met no point with every constraint kept has no value, whatever else the verdict says.
        bad |= ~np.isfinite(dataset["history_best_value"].values).any(axis=1)
    return np.where(bad, np.inf, cost)


def holm(probabilities: list[float]) -> list[float]:
    """Holm's corrected probabilities, in the order given."""
    count = len(probabilities)
    corrected, largest = np.ones(count), 0.0
    for rank, index in enumerate(np.argsort(probabilities, kind="stable")):
        largest = max(largest, min(1.0, (count - rank) * probabilities[index]))
        corrected[index] = largest
    return corrected.tolist()


def _friedman(medians: np.ndarray) -> float | None:
    """Over at least three settings (rows); None where all are tied or there are fewer."""
    from scipy.stats import friedmanchisquare, rankdata

    if medians.shape[0] < 3:
        return None
    ranks = np.apply_along_axis(rankdata, 1, medians)
    if np.all(ranks == ranks[0, 0]):
        return None
    return float(friedmanchisquare(*ranks.T).pvalue)
