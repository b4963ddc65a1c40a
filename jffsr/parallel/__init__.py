"""Many candidates at once: in chunks that fit the memory, over cores, devices and processes. Knows no robots."""
