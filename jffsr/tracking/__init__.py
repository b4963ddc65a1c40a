"""Resolved-rate tracking of a tool's path, and where a robot loses directions on the way."""
