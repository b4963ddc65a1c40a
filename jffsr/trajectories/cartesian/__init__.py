"""Paths of a tool in space and how they are gone along in time."""
