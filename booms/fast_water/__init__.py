"""Booms for fast water: nets, which let the water through, and pockets, which slow it."""
