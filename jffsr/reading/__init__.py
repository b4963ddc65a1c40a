"""Reading what users write: text files, YAML with the line of every key, and errors told in one sentence."""
