"""Plates thinner than a particle hold water, whether they are held, move or float."""

from __future__ import annotations

import math

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


@pytest.mark.parametrize(("thickness", "speed"), [(0.3, 0.0), (1.0, 0.0), (1.0, 1.5)])
def test_no_particle_passes_a_plate_that_moves_as_floating_ones_do(make_fluid, thickness: float, speed: float) -> None:
    """Water of eight spacings on one side; the plate of its own thickness stands, or swings to and fro by up to 0.15 spacings a step."""
    upper, face, x = (2.4, 1.0, 2.4), 1.2 - 0.5 * thickness * SPACING, 1.2
    fluid = make_fluid(lower=(0, 0, 0), upper=upper)
    fluid.add_boundary(tank_walls((0, 0, 0), upper, SPACING))
    sampling = sample_surface(box((thickness * SPACING, 1.6, 4.0)), SPACING)
    assert sampling.plate_normal is not None
    assert np.abs(sampling.plate_normal).max(axis=0) == pytest.approx([1.0, 0.0, 0.0])
    handle = fluid.add_boundary(particles_of("plate", sampling))
    fluid.add_particles(block((face - 1.1, 0, 0), (face, 1.0, 0.8), SPACING), phase="water")
    for n in range(100):
        velocity = (speed * math.sin(4.0 * math.pi * 0.01 * n), 0.0, 0.0)
        fluid.set_boundary_motion(handle, (x, 0.5, 1.2), (0, 0, 0, 1), velocity, (0, 0, 0))
        fluid.advance(0.01)
        x += 0.01 * velocity[0]
    assert fluid.particle_count == 880
    assert np.max(fluid.particles.position[0]) < x


def test_a_drop_that_a_thin_plate_stops_gives_it_its_momentum(make_fluid) -> None:
    """Without weight, a free plate of 1 kg and one particle of water of 1 kg: together they keep momentum and angular momentum."""
    fluid = make_fluid(lower=(-2, -2, -2), upper=(2, 2, 2), gravity=(0.0, 0.0, 0.0))
    sampling = sample_surface(box((0.5 * SPACING, 0.8, 0.8)), SPACING)
    handle = fluid.add_boundary(particles_of("plate", sampling))
    fluid.add_particles([[-0.3, 0.13, 0.21]], phase="water", velocity=(5.0, 0.5, 0.0))
    mass = fluid.config.rest_volume * fluid.config.phases[0].rest_density
    inverse = np.diag([1.0, 1.0, 1.0, 20.0, 20.0, 20.0])
    pose, turn, twist = np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(6)
    for _ in range(40):
        fluid.set_boundary_motion(handle, pose, turn, twist[:3], twist[3:], inverse)
        fluid.advance(0.005)
        pose, turn, twist = fluid.boundary_motion(handle)
    velocity, place = (
        np.asarray(each[:, 0], np.float64) for each in (fluid.particles.velocity, fluid.particles.position)
    )
    assert twist[0] > 0.5 and place[0] < pose[0] + 0.1 * SPACING
    assert mass * velocity + twist[:3] == pytest.approx(mass * np.array([5.0, 0.5, 0.0]), abs=1e-5)
    turning = mass * np.cross(place, velocity) + twist[3:] / 20.0 + np.cross(pose, twist[:3])
    assert turning == pytest.approx(mass * np.cross([-0.3, 0.13, 0.21], [5.0, 0.5, 0.0]), abs=2e-2)
