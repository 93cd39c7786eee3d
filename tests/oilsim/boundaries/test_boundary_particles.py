"""Walls act where the geometry has them: a lattice at rest against them has density error 0."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import BoundaryParticles, block, solid_box, tank_walls
from oilsim.boundaries.boundary_particles import wall_coverage
from oilsim.density.density_constraint import density_and_diagonal
from oilsim.neighborhood.smoothing_kernels import SUPPORT, normalisation
from tests.oilsim.conftest import search


@pytest.mark.parametrize("dimension", [2, 3])
def test_lattice_at_rest_against_walls_keeps_its_density_to_the_corners(make_fluid, dimension):
    spacing, size = 0.1, (1.0, 1.0, 1.0)
    fluid = make_fluid(lower=(-0.5,) * 3, upper=(1.5, 1.5, 1.5), dimension=dimension)
    sides = ("-x", "+x", "-z") + (("-y", "+y") if dimension == 3 else ())
    fluid.add_boundary(tank_walls((0, 0, 0), size, spacing, sides=sides, dimension=dimension))
    fluid.add_particles(block((0, 0, 0), size, spacing, dimension), phase="water")
    arrays = fluid.arrays
    search(fluid)
    position = fluid.state.position
    geometry = arrays.neighbors.neighborhood
    compression, diagonal = np.empty((2, fluid.particle_count), np.float32)
    gradient = np.empty_like(position)
    density_and_diagonal(0, fluid.particle_count, geometry, compression, diagonal, gradient)
    inside = position[2] < 1.0 - SUPPORT * spacing
    # the walls continue the lattice, as far as the kernel reaches: 80 terms in float32
    assert np.abs(compression[inside]).max() < 80 * np.finfo(np.float32).eps
    assert np.abs(gradient[:, inside]).max() * spacing < 80 * np.finfo(np.float32).eps
    assert inside.sum() >= 7 * 10 ** (dimension - 1)


@pytest.mark.parametrize("dimension", [2, 3])
def test_coverage_falls_with_distance_and_matches_the_missing_lattice(dimension):
    values = [wall_coverage(distance, dimension) for distance in (0.0, 0.25, 0.5, 1.0, 1.5)]
    assert values == sorted(values, reverse=True)
    # half a spacing before the wall, it replaces the two layers of the lattice that it displaces, one spacing and two away
    axis = np.arange(-3, 4)
    across = np.stack(np.meshgrid(axis, axis if dimension == 3 else [0]), axis=-1).reshape(-1, 2)
    q = np.minimum(np.hypot(np.linalg.norm(across, axis=1)[:, None], [1.0, 2.0]) / SUPPORT, 1.0)
    layers = normalisation(1.0, dimension) * ((1.0 - q) ** 4 * (1.0 + 4.0 * q)).sum()
    # quadrature on a lattice of a sixteenth of a spacing and sheets instead of lattices across: 1e-3
    assert values[2] == pytest.approx(layers, rel=1e-3)


@pytest.mark.parametrize("dimension", [2, 3])
def test_tank_walls_are_two_layers_of_lattice_and_have_the_tanks_area(dimension):
    size, spacing = np.array([0.8, 0.4, 0.6]), 0.1
    sides = tuple(sign + axis for axis in ("xz" if dimension == 2 else "xyz") for sign in "-+")
    walls = tank_walls((0, 0, 0), size, spacing, sides=sides, dimension=dimension)
    inside = np.round(size / spacing).astype(int)
    if dimension == 2:
        inside, size = inside[[0, 2]], size[[0, 2]]
    assert len(walls.position) == (inside + 4).prod() - inside.prod()
    # on the lattice of the liquid, half a spacing from the corner: cells, d^dimension each
    index = walls.position[:, [0, 2] if dimension == 2 else [0, 1, 2]] / spacing - 0.5
    assert index == pytest.approx(np.round(index), abs=1e-9)
    assert walls.volume == pytest.approx(np.full(len(walls.volume), spacing**dimension))
    assert walls.area.sum() == pytest.approx(sum(2.0 * size.prod() / side for side in size))


def test_walls_of_sizes_between_spacings_stand_for_all_their_area():
    walls = tank_walls((0, 0, 0), (0.83, 0.37, 0.61), 0.1)
    # columns before a side are stretched to fill it; layers lie half a spacing and one and a half behind it
    assert walls.area.sum() == pytest.approx(2.0 * (0.83 * 0.37 + 0.37 * 0.61 + 0.61 * 0.83))
    lowest = np.unique(np.round(walls.position[:, 2], 9))
    assert lowest[:2] == pytest.approx([-0.15, -0.05])


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("size", [(0.8, 0.6, 1.0), (0.83, 0.57, 1.02)])  # on the lattice, and between its places
def test_solid_box_is_the_two_outer_layers_of_its_lattice_and_has_the_boxes_area(dimension, size):
    axes = [0, 2] if dimension == 2 else [0, 1, 2]
    solid, size = solid_box(size, 0.1, dimension=dimension), np.array(size)[axes]
    place = solid.position[:, axes]
    assert place.min(axis=0) == pytest.approx(-place.max(axis=0))  # about its centre
    # the outermost layer lies half a spacing under each side
    assert place.max(axis=0) == pytest.approx(0.5 * size - 0.05, abs=5e-3)
    assert solid.area.sum() == pytest.approx(sum(2.0 * size.prod() / side for side in size), rel=1e-6)
    inner = np.abs(place) < 0.5 * size - 0.2
    assert not inner.all(axis=1).any()
    cells = np.round(size / 0.1)
    share = 1.0 - ((cells - 4.0) / cells).prod()  # two layers on either side of each axis
    assert solid.volume.sum() == pytest.approx(share * size.prod(), rel=0.02)
    assert len(place) == cells.prod() - (cells - 4.0).prod()


def test_periodic_axis_cannot_be_closed():
    with pytest.raises(ValueError, match=r"side '-x' is closed, allowed: open"):
        tank_walls((0, 0, 0), (1, 1, 1), 0.1, periodic=(True, False, False))


def test_unsound_boundary_is_refused():
    with pytest.raises(ValueError, match=r"volume has shape \(2,\), allowed: \(M,\)"):
        BoundaryParticles(name="rock", position=np.zeros((3, 3)), volume=np.zeros(2), area=np.zeros(3))


@pytest.mark.parametrize("value", [np.nan, np.inf, -1e-9])
@pytest.mark.parametrize("what", ["volume", "area", "position"])
def test_one_unsound_value_among_sound_ones_is_refused(what, value):
    values = {"position": np.ones((3, 3)), "volume": np.ones(3), "area": np.ones(3)}
    BoundaryParticles(name="rock", **values)
    values[what].flat[1] = value
    if what == "position" and np.isfinite(value):
        BoundaryParticles(name="rock", **values)  # a place may be negative
        return
    with pytest.raises(ValueError, match=f"boundary 'rock': {what} must be finite"):
        BoundaryParticles(name="rock", **values)
