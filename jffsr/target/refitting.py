"""All poses so far fitted together anew: what keeps a filter from growing too sure of itself.

Between two fits the filter linearises each pose about another estimate, and seems to learn from their differences what
no pose tells; a new fit takes that back. Its cost grows with the number of poses.
"""

from __future__ import annotations

import jax

from jffsr.target.camera import Measurements
from jffsr.target.curved_covariance import curved_estimate
from jffsr.target.estimate import TargetEstimate, corrected
from jffsr.target.least_squares import fit_pass
from jffsr.target.prior import TargetPrior
from jffsr.types import Array, Matrix, Scalar


def refit(
    start: TargetEstimate,
    poses: Measurements,
    until: Scalar,
    trusted: Array,
    interval: float,
    prior: TargetPrior,
    noise: Matrix,
    order: int,
) -> tuple[TargetEstimate, TargetEstimate]:
    """The most probable estimate at the first pose, and the mean with its covariance one interval after the first
    `until` of the poses (N, ...), of which those count that are trusted (N,).

    start is the estimate at the first pose that an earlier fit has found. The target is taken for free all the time.
    """

    def one_pass(start: TargetEstimate, _):
        found = fit_pass(start, poses, until, lambda k, _: trusted[k], interval, prior, noise, order)
        return corrected(start, found.correction), (start, found)

    # The second corrects nothing more: it gives the covariance.
    _, passes = jax.lax.scan(one_pass, start, length=2)
    best, found = jax.tree.map(lambda x: x[-1], passes)
    return best, curved_estimate(best, found, poses, until, trusted, interval, prior, noise)
