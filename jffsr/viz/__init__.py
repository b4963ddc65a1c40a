"""Figures of a finished run, and of a robot standing still.

Importing the modules in here imports matplotlib; nothing above does.
"""
