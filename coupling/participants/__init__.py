"""Participants that the master can step: the fluid and pybullet's rigid bodies."""
