"""A run or sweep watched while it is under way: read from its folder alone, shown in a browser."""
