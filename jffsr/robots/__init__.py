"""Robots as pytrees: descriptions, the checks at loading, and the catalogue."""
