"""Tracking of Cartesian paths on the generalized Jacobian, and where a robot loses directions."""
