"""Studies described by configuration files: reading them, running them, keeping what they give."""
