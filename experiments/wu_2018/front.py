"""Error against peak rate: the published method over its parameters, refined motions, another posture."""

from __future__ import annotations

import numpy as np

from experiments.wu_2018.case import Case, Measured
from experiments.wu_2018.freedoms import (
    ELBOW,
    FEEDBACK,
    Gained,
    exact_in_time,
    exact_way,
    refined,
    tracked_with,
)
from experiments.wu_2018.published import grid_of_pairs, scan

PEAKS = (4.0, 5.0, 6.06, 7.0, 8.0, 9.0)
PAIRS = "published method, pairs on a grid"
ELBOW_PEAKS = (3.0, 3.4, 3.8, 4.2, 5.0, 6.06)


def front(case: Case, duration: float, reference: Measured, refined_rates: Gained) -> dict[str, np.ndarray]:
    """Curves of peak, deg/s, and error over the published method's, (2, m) each, by what they are."""
    scanned = scan(case, duration, grid_of_pairs())
    error = np.maximum(scanned[2] / reference.position, scanned[3] / reference.attitude)
    curves = {PAIRS: np.stack([scanned[0], error])}
    through, around, elbow = [], [], []
    exact, of = exact_way(case), refined_rates
    for peak in PEAKS:
        of = refined(case, refined_rates, peak, 12)
        through.append((peak, of.measured.over(reference)))
        begun = exact_in_time(case, exact, duration, peak)
        around.append((peak, refined(case, begun, peak, 12, retime=True).measured.over(reference)))
    fed_back = tracked_with(case, duration, FEEDBACK, ELBOW, "", "")
    for peak in ELBOW_PEAKS:
        found = refined(case, fed_back, peak, 10, retime=peak < fed_back.measured.peak)
        elbow.append((peak, found.measured.over(reference)))
    curves["refined, through the singularity"] = _within(through)
    curves["refined, around it at a free pace"] = _within(around)
    curves["refined, from the other elbow"] = _within(elbow)
    return curves


def _within(found: list[tuple[float, float]]) -> np.ndarray:
    """Peak and the least error found within it, (2, m): what keeps a lower peak keeps the higher ones."""
    peak, error = np.array(found).T
    return np.stack([peak, np.minimum.accumulate(error)])
