"""Sweeps: many planning studies that differ in a few keys, computed together and gone on with after any end."""
