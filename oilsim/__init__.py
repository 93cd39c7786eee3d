"""The fluid core: phases, constraints, viscosity and forcing of a particle fluid. Needs numpy and numba only."""
