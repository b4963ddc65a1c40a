"""Reactionless motion: the base held still while the arm moves, and carries what it does not know."""
