"""Robots out of parts: where a part sits, and how two become one."""
