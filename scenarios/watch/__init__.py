"""What is read from a run while it goes on: scores, probes, frames and warnings."""
