"""Orders to a run from another program: how the run is found, and what the two say to each other."""
