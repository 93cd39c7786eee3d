"""Solids from meshes, and wall particles from solids: reading, signed distance, sampling, hydrostatics and added mass."""
