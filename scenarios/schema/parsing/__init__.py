"""Parsing turns the text of a scenario file into checked values: overrides, types, units, limits, compass courses."""
