"""Every optimizer on the real objectives of space robots: performance profiles and a table of wins."""
