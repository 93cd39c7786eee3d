"""Observation of a run: scores, probes, frames and warnings."""
