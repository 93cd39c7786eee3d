"""Water for pybullet worlds of tests."""

from __future__ import annotations

import numpy as np

from oilsim.boundaries.boundary_particles import tank_walls
from oilsim.config import FluidConfig
from oilsim.initial_conditions import block
from oilsim.phases import Phase
from oilsim.solver import Fluid


def pool(
    spacing: float, side: float, depth: float, hollow: tuple[tuple[float, float, float], ...] = ((0, 0, 0), (0, 0, 0))
) -> Fluid:
    """A square tank of water on the ground, centred on the z axis, but for a hollow box (centre, half extents)."""
    half = 0.5 * side
    config = FluidConfig(
        particle_spacing=spacing,
        phases=(Phase(name="water", rest_density=1000.0),),
        lower=(-side, -side, -side),
        upper=(side, side, 3.0 * side),
    )
    fluid = Fluid(config, threads=1)
    sides = ("-x", "+x", "-y", "+y", "-z")
    fluid.add_boundary(tank_walls((-half, -half, 0.0), (half, half, 2.0 * side), spacing, sides=sides))
    if depth == 0.0:
        return fluid
    water = block((-half, -half, 0.0), (half, half, depth), spacing)
    center, extents = hollow
    fluid.add_particles(water[(np.abs(water - center) >= extents).any(axis=1)], phase="water")
    return fluid
