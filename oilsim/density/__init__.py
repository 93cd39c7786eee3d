"""Constant density: the constraint, its feedback to the pressure solve, and the shifting of particles."""
