"""Walls and solids for a fluid of one's own, to be given to `Fluid.add_boundary`: tanks, boxes, or any particles."""

from __future__ import annotations

from oilsim.boundaries.boundary_particles import SIDES, BoundaryParticles, solid_box, tank_walls

__all__ = ["SIDES", "BoundaryParticles", "solid_box", "tank_walls"]
