"""What is surely wrong with a capture before anything is planned."""

from __future__ import annotations

import numpy as np

from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.outcome import CaptureCode, CaptureResult, explain_capture
from jffsr.clearance.model import ClearanceModel
from jffsr.clearance.reports import check_start
from jffsr.errors import InputError
from jffsr.robots.geometry import COLLISION, Geometry
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.target.prediction import GraspPrediction, has_converged


def check_capture(
    robot: Robot,
    path: GraspPath,
    initial_state: State,
    clearance: ClearanceModel | None = None,
    geometry: Geometry | None = None,
    prediction: GraspPrediction | None = None,
) -> CaptureResult | None:
    """The result of a capture that need not be planned, None where nothing is wrong; on the host.

    The prediction that stands behind the target's motion has not converged; the grasp frame lies inside a solid of the
    target's `geometry`; robot and target, or bodies of the robot, overlap at the path's beginning.
    """
    if prediction is not None and not bool(has_converged(prediction)):
        return explain_capture(CaptureCode.ESTIMATE_NOT_CONVERGED)
    point = np.asarray(path.position_T)
    for shape in geometry.shapes if geometry is not None else ():
        if COLLISION in shape.roles and shape.contains(point[None])[0]:
            return CaptureResult(
                CaptureCode.GRASP_INSIDE_BODY,
                f"the grasp point {[round(float(x), 6) for x in point]} m in T lies inside the target's shape "
                f"'{shape.name}', where no tool can go; move it out",
            )
    # Where only the grasp's time is given, where the target is at the beginning is not known.
    if clearance is not None and path.grasp_time is None:
        begin = path.target_state(np.zeros(()), np.zeros(()))
        try:
            check_start(clearance, robot, initial_state, begin if clearance.has_target else None)
        except InputError as wrong:
            return CaptureResult(CaptureCode.START_IN_COLLISION, str(wrong))
    return None
