"""Accounts of energy and momentum, and diagnostics of a state."""
