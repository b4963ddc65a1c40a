"""Replays as a film: when its pictures are taken, from where, how they are drawn, labelled and encoded."""
