"""Spreading on calm water: the laws, the grid of thickness, and the motion of parcels."""
