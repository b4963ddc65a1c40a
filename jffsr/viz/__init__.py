"""Figures of a finished run. Importing the modules in here imports matplotlib; nothing above does."""
