"""Reactionless motion after capture, measured: Ye, Dong and Hong 2019."""
