"""Rotations, inertias, and norms and roots whose gradients stay finite."""
