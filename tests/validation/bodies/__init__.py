"""Validation cases of bodies and booms in a liquid."""
