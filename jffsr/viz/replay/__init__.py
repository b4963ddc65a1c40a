"""Runs as moving pictures: what moves, where it has been, and what comes near its limits, for any viewer."""
