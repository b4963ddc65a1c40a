"""A tumbling target: its motion, a camera that sees it, and the filter that estimates and predicts it."""
