"""Capture studies: a robot grasps a tumbling target that is known, or that a camera has observed."""
