"""The density of liquid below a free surface, told from the kernel's sum and its slope, and what pressure makes of it."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import block, tank_walls
from oilsim.density.density_feedback import (
    FeedbackScales,
    add_density_feedback,
    density_below_surface,
    surface_table,
)
from oilsim.neighborhood.smoothing_kernels import SUPPORT, kernel, kernel_slope_over_q, lattice, normalisation


def seen(depth, stretch, dimension):
    """e and g [spacing 1] of a lattice's particle `depth` layers below the free surface, of a lattice `stretch` as wide."""
    points = stretch * lattice(1.0, dimension)
    points = points[points[:, 2] <= stretch * (depth + 0.5)]
    q = np.linalg.norm(points, axis=1) / SUPPORT
    sigma = normalisation(1.0, dimension)
    content = kernel(q, sigma).sum()
    slope = kernel_slope_over_q(q, sigma) @ points / SUPPORT**2
    return content - 1.0, slope


def found(depth, stretch, dimension):
    """f - 1 that such a particle is told to have."""
    error, slope = seen(depth, stretch, dimension)
    return float(density_below_surface(np.float32(error), *slope.astype(np.float32), surface_table(1.0, dimension)))


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("depth", [0, 1, 2, 3])
def test_a_lattice_has_its_density_up_to_the_free_surface(dimension, depth):
    assert abs(found(depth, 1.0, dimension)) < 1e-3


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("depth", [0, 1, 2])
@pytest.mark.parametrize("density", [0.9, 1.05])
def test_swollen_and_pressed_liquid_is_known_at_the_free_surface(dimension, depth, density):
    # between what an integral and what a lattice has, 3 % in the first layer, nothing is asked for
    told = 1.0 + found(depth, density ** (-1.0 / dimension), dimension)
    assert told == pytest.approx(density, abs=0.035 if depth == 0 else 0.012)


def test_a_drop_s_edge_tells_nothing():
    table = surface_table(1.0, 3)
    steep = np.float32(2.0 * (table.shares.shape[1] - 1) / table.per_slope)
    assert density_below_surface(np.float32(0.0), steep, np.float32(0.0), np.float32(0.0), table) == 0.0


@pytest.mark.parametrize("layers", [3, 12])
def test_water_that_has_swollen_below_its_surface_falls_together(make_fluid, layers):
    # a pool all of whose spacings upwards, or those of its upper quarter, are a twelfth too wide
    spacing, depth = 0.05, 12
    fluid = make_fluid(particle_spacing=spacing, dimension=2, lower=(-0.2,) * 3, upper=(1.2, 1.2, 1.2))
    fluid.add_boundary(tank_walls((0, 0, 0), (1, 0, 1), spacing, sides=("-x", "+x", "-z"), dimension=2))
    points = block((0, 0, 0), (1, 0, depth * spacing), spacing, 2)
    points[:, 2] += np.maximum(points[:, 2] - (depth - layers) * spacing, 0.0) / 12.0
    fluid.add_particles(points, phase="water")

    def swollen():
        return 2.0 * (fluid.state.position[2].mean(dtype=np.float64) / spacing - 0.5 * depth)

    before = swollen()
    for _ in range(20):
        fluid.advance(0.05)
    assert before == pytest.approx(
        (layers / depth) ** 2, rel=1e-4
    )  # in spacings: layers / 12 at the top, layers^2 / 24 in all
    assert abs(swollen()) < 0.2 * before


@pytest.mark.parametrize("error", [0.02, -0.02])
def test_pressed_liquid_is_let_apart_and_swollen_liquid_drawn_together(error):
    """By its share of the error in each time of return; a strain that keeps volumes adds nothing to it at rest."""
    flow, rate = np.zeros((1, 16), np.float32), np.zeros(1, np.float32)
    scales = FeedbackScales(np.float32(1.0), np.float32(0.01), np.float32(0.1))
    terms = np.array([error], np.float32), np.zeros((3, 1), np.float32), np.zeros(1, np.uint8)
    add_density_feedback(0, 1, *terms, flow, np.zeros(1, np.float32), surface_table(1.0, 3), scales, rate)
    assert rate[0] == pytest.approx(error / 0.1, rel=1e-5)
