"""Quantities as text, and the terminal."""
