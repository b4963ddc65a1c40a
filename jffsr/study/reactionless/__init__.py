"""Reactionless studies: the base held still after contact with an unknown load, and what that takes."""
