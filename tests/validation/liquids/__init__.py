"""Validation cases of liquids alone, and of a sphere that settles in one."""
