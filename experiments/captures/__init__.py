"""A thousand random captures: what share is solved, and how fast."""
