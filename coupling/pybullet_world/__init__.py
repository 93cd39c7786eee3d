"""Reading of bodies in a pybullet client that belongs to another program."""
