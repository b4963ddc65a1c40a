"""Kinematics, inertia blocks, momentum and the generalized Jacobian of a free-floating tree."""
