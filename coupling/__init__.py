"""The co-simulation master, its participants, and the plugin that puts fluid into a pybullet world."""
