"""Drops too small for particles to carry their flow: how fast they rise, and how that moves particles."""
