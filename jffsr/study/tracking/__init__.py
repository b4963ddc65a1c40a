"""Tracking studies: the tool follows a path in space while the base floats."""
