"""Quantities in words, and the terminal."""
