"""Base motion along a joint trajectory under conservation of momentum."""
