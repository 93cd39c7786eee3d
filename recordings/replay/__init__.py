"""Replay: reading, checking, comparing and repairing recordings."""
