"""Controllers of the joints: they know the robot without its load, and what is measured."""
