"""Signed distances between the bodies of a robot and to a free target, with gradients."""
