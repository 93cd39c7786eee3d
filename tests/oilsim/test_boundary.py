"""Walls act where the geometry has them: a lattice at rest against them has density error 0."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim.boundary import BoundaryParticles, half_space_integral, lattice_wall_factor, tank_walls, wall_coverage
from oilsim.initial_conditions import block


@pytest.mark.parametrize("dimension", [2, 3])
def test_lattice_at_rest_against_walls_keeps_its_density(make_fluid, dimension):
    spacing, size = 0.1, (1.0, 1.0, 1.0)
    low = (-0.5, -0.5, -0.5)
    fluid = make_fluid(lower=low, upper=(1.5, 1.5, 1.5), dimension=dimension, density_tolerance=1e-3)
    fluid.add_boundary(tank_walls((0, 0, 0), size, spacing, sides=("-x", "+x", "-z") + (("-y", "+y") if dimension == 3 else ()),
                                  dimension=dimension))  # fmt: skip
    fluid.add_particles(block((0, 0, 0), size, spacing, dimension), phase="water")
    fluid.work.search(fluid.state)
    fluid.work.linearise(fluid.state.position)
    position, density = fluid.state.position, fluid.work.density
    inside = position[2] < 0.8
    across = np.minimum(position[0], 1.0 - position[0]) < spacing
    low_layer = position[2] < spacing
    flat = low_layer & ~across
    if dimension == 3:
        flat &= np.minimum(position[1], 1.0 - position[1]) > spacing
    # flat walls are calibrated to the lattice; wall points and lattice do not register, which leaves 1 %
    assert np.abs(density[flat] - 1.0).max() < 0.01
    # in edges and corners the calibrated integral differs from the lattice sum
    assert np.abs(density[inside] - 1.0).max() < 0.05
    assert abs(density[inside].mean() - 1.0) < 0.005


@pytest.mark.parametrize("dimension", [2, 3])
def test_coverage_falls_with_distance_and_matches_the_missing_lattice(dimension):
    values = [wall_coverage(distance, dimension) for distance in (0.0, 0.25, 0.5, 1.0, 1.5)]
    assert values == sorted(values, reverse=True)
    # at half a spacing two sheets cover what the lattice layers have that they displace
    layers = lattice_wall_factor(dimension) * half_space_integral(0.5, dimension)
    assert values[2] == pytest.approx(layers, abs=1e-3)
    assert 0.9 < lattice_wall_factor(dimension) < 0.95


def test_calm_spread_tank_has_the_papers_wall_particles():
    walls = tank_walls((0, 0, 0), (4, 2, 4), 0.03)
    # Qiu et al. 2021 give 175.1k
    assert len(walls.position) == pytest.approx(175_100, rel=0.02)


def test_periodic_axis_cannot_be_closed():
    with pytest.raises(ValueError, match=r"side '-x' is closed, allowed: open"):
        tank_walls((0, 0, 0), (1, 1, 1), 0.1, periodic=(True, False, False))


def test_unsound_boundary_is_refused():
    with pytest.raises(ValueError, match=r"volume has shape \(2,\), allowed: \(M,\)"):
        BoundaryParticles(name="rock", position=np.zeros((3, 3)), volume=np.zeros(2), area=np.zeros(3))
    with pytest.raises(ValueError, match="must be finite"):
        BoundaryParticles(name="rock", position=np.zeros((1, 3)), volume=np.array([np.nan]), area=np.zeros(1))
