"""One time step: its arrays, its stages and their order."""
