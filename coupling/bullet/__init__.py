"""Worlds of pybullet: bodies with contacts, the client of the user's own, and the plugin that gives it a fluid."""
