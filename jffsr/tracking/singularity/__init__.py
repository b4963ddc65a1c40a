"""Where a robot's tool loses directions of motion: along a motion, and over the joint space."""
