"""Problem = robot + trajectory + objective; plans, their verification and result codes."""
