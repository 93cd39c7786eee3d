"""Sweeps: many runs of one scenario, and their results in one table."""
