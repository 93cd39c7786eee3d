"""The tables of a scenario file."""
