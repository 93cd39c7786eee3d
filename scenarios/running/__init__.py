"""A run from start to end: assembly, loop, orders, checkpoints and summary."""
