"""Held plates thinner than a particle hold water."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.bodies import box
from coupling.solids.surface_sampling import particles_of, sample_surface
from coupling.solids.thin_parts import HELD
from oilsim.boundaries.boundary_particles import tank_walls
from oilsim.initial_conditions import block

SPACING = 0.1


@pytest.mark.parametrize("thickness", [0.3, 1.0, 1.1])
def test_no_particle_passes_a_held_plate_under_eight_spacings_of_water(make_fluid, thickness: float) -> None:
    upper, face = (2.4, 1.0, 1.6), 1.2 - 0.5 * thickness * SPACING
    fluid = make_fluid(lower=(0, 0, 0), upper=upper)
    fluid.add_boundary(tank_walls((0, 0, 0), upper, SPACING, sides=("-x", "+x", "-y", "+y", "-z")))
    plate = box((thickness * SPACING, 1.6, 2.4)).apply_translation((1.2, 0.5, 0.8))
    sampling = sample_surface(plate, SPACING, minimum_thickness=HELD * SPACING)
    fluid.add_boundary(particles_of("plate", sampling))
    fluid.add_particles(block((face - 1.1, 0, 0), (face, 1.0, 0.8), SPACING), phase="water")
    for _ in range(100):
        fluid.advance(0.01)
    assert np.max(fluid.particles.position[0]) < 1.2
