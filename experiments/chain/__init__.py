"""A hundred chains, from a camera's first pose of a random tumbling box to a base that is held still."""
