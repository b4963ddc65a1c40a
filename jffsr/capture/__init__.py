"""Capture of a tumbling target by a free-floating robot: when, from where, along which motion, and what follows."""
