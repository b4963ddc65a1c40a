"""Pages that one file holds: a replay with its plots, and the report of a run or sweep."""
