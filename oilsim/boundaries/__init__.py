"""Walls and solid surfaces as particles, contact with them, and adhesion."""
