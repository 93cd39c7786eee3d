"""The engine: a pybullet client of our own, its state as bytes, and one sub-step of it."""
