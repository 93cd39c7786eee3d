"""Rigid bodies, joints, lines and contacts, stepped on a pybullet client."""
