"""Accounts of a run, and the readings of it while it goes on: scores, sums, probes, frames and warnings."""
