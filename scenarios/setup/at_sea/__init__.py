"""The sea of a scenario by formulas, and runs in which it takes the place of particles."""
