"""Measured speed: scripts that print tables, not tests."""
