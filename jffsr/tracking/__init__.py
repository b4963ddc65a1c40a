"""A tool that follows a Cartesian path while the base floats: resolved rates on the generalized Jacobian."""
