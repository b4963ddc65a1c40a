"""Capture of a tumbling target: where the arm can grasp, when it should, and what happens at the grasp."""
