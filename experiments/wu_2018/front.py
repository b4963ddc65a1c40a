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
ELBOW_PEAKS = (3.0, 3.4, 3.8, 4.2, 5.0, 6.06)


def non_dominated(peak: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Indices, by rising peak, of those than which none has both a lower peak and a lower error."""
    order = np.lexsort((error, peak))
    lowest = np.concatenate([[np.inf], np.minimum.accumulate(error[order])[:-1]])
    return order[error[order] < lowest]


def front(case: Case, duration: float, reference: Measured, refined_rates: Gained) -> dict[str, np.ndarray]:
    """Curves of peak, deg/s, and error over the published method's, (2, m) each, by what they are."""
    scanned = scan(case, duration, grid_of_pairs())
    error = np.maximum(scanned[2] / reference.position, scanned[3] / reference.attitude)
    best = non_dominated(scanned[0], error)
    curves = {"published method, all pairs": np.stack([scanned[0][best], error[best]])}
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
    curves["refined, through the singularity"] = np.array(through).T
    curves["refined, around it at a free pace"] = np.array(around).T
    curves["refined, from the other elbow"] = np.array(elbow).T
    return curves
