"""Point measurements, beside sides at which the sea repeats too."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import block

LENGTH, SPACING = 2.0, 0.1


@pytest.fixture
def wavy(make_fluid):
    """A sea that repeats along x, its surface and its pressure those of one wave of its length."""
    fluid = make_fluid(periodic=(True, False, False))
    points = block((0, 0, 0), (LENGTH, 2, 1.6), SPACING)
    fluid.add_particles(points[points[:, 2] < level(points[:, 0])], phase="water")
    state = fluid.state
    state.pressure_impulse[:] = pressure(state.position[0]) * 1e-3
    state.time_step = 1.0
    return fluid


def level(x):
    return 1.2 + 0.3 * np.cos(2 * np.pi * x / LENGTH)


def pressure(x):
    return 1.5 + np.sin(2 * np.pi * x / LENGTH)


@pytest.mark.parametrize("x", [0.0, 0.03, 0.5, 0.7, 1.0, 1.96, LENGTH])
def test_readings_are_those_of_a_periodic_sea(wavy, x):
    # second order in the support over the wave: (k H)^2 / 10
    assert wavy.pressure_at([(x, 1.0, 0.5)])[0] == pytest.approx(pressure(x), abs=0.07)
    # between the surface there and its highest place within a support across, each half a layer off
    highest = level(x + np.linspace(-1.0, 1.0, 201) * wavy.config.support_radius).max()
    assert level(x) - SPACING / 2 <= wavy.surface_height_at([(x, 1.0)])[0] <= highest + SPACING / 2 + 1e-6


def test_readings_do_not_know_where_the_seam_is(wavy):
    ends = [(x, 1.0, 0.5) for x in (0.0, LENGTH)]
    assert np.ptp(wavy.pressure_at(ends)) < 1e-6
    assert np.ptp(wavy.surface_height_at([point[:2] for point in ends])) < 1e-6


@pytest.mark.parametrize("points", [(1.0, 1.0, 1.0), [(1.0, 1.0)], [(1.0, 1.0, np.nan)]])
def test_points_that_are_none_are_refused(wavy, points):
    for read in (wavy.pressure_at, wavy.velocity_at):
        with pytest.raises(ValueError, match="points ha"):
            read(points)


def test_a_gauge_does_not_count_spray_and_a_dry_floor_is_dry(make_fluid):
    fluid = make_fluid()
    points = block((0, 0, 0), (1.0, 1.0, 0.4), SPACING)
    fluid.add_particles(points, phase="water")
    drops = [(0.5, 0.5, 0.5), (0.5, 0.55, 0.85), (1.55, 1.5, 0.75), (1.45, 1.5, 0.95)]
    fluid.add_particles(drops, phase="water")
    wet, dry, nothing = fluid.surface_height_at([(0.5, 0.5), (1.5, 1.5), (1.9, 0.2)])
    assert wet == pytest.approx(0.4, abs=1e-6)
    assert dry == nothing == fluid.config.lower[2]
