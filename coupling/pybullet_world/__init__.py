"""Reading bodies of a pybullet client that somebody else owns."""
