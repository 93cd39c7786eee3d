"""Flumes with a skirt that holds oil in a current."""
