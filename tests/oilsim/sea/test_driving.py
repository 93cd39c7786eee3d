"""A sea that drives the particles of a tank: zones, the stress of the wind, and the shear of its drift."""

from __future__ import annotations

import math

import numpy as np
import pytest

from oilsim import Phase, block, tank_walls
from oilsim.forcing import ForcingView
from oilsim.sea import KaimalGusts, RegularWaves, SeaForcing, WindDrift, Zone
from oilsim.sea.wind_stress import wind_stress
from tests.seas import current_in, shallow_sea

EVERYWHERE = Zone((-10.0,) * 3, (10.0,) * 3)
WAVES = RegularWaves(height=0.1, period=1.2, direction=0.5)
STREAM = (0.2, -0.1)
BREEZE = 10.0  # m/s


def view(position, velocity, step, gradient=(0.0, 0.0, 0.0), time=0.0):
    """What a forcing sees of particles at positions (N, 3) [m] of water."""
    count = len(position)
    return ForcingView(
        time, step, np.array(position, np.float32).T, velocity, np.zeros(count, np.uint8),
        np.tile(np.array(gradient, np.float32)[:, None], count), np.array([1025.0]), 1e-3,
    )  # fmt: skip


def test_a_current_is_reached_with_its_time_constant(make_fluid):
    fluid = make_fluid(gravity=(0, 0, 0))
    fluid.add_particles(block((0.5, 0.5, 0.5), (0.8, 0.8, 0.8), 0.1), phase="water")
    fluid.add_forcing(current_in(EVERYWHERE, STREAM))
    for _ in range(50):
        fluid.advance(0.01)
    expected = np.array([*STREAM, 0.0]) * (1 - math.exp(-0.5 / 0.5))
    assert fluid.phase_velocities("water").mean(axis=0) == pytest.approx(expected, abs=1e-4)


def test_water_in_a_zone_takes_up_the_velocity_of_the_sea():
    """All three components where the sea has waves; the vertical one is left alone without, and in a zone that leaves waves alone."""
    points = np.array([(0.3, 0.4, 0.5), (0.1, -0.2, 0.9)])
    for waves, zone_waves in ((WAVES, True), (WAVES, False), (None, True)):
        sea = shallow_sea(1.0, current=STREAM, waves=waves)
        forcing = SeaForcing(sea, spacing=0.1, zones=[Zone((-1, -1, -1), (1, 1, 1), 1e-6, waves=zone_waves)])
        velocity = np.full((3, 2), 0.05, np.float32)
        forcing.apply(view(points, velocity, 0.1, time=0.7))
        follows = waves is not None and zone_waves
        expected = sea.velocity(points, 0.7) if follows else np.array([[*STREAM, 0.05]] * 2)
        np.testing.assert_allclose(velocity.T, expected, atol=1e-6)


def test_a_particle_belongs_to_the_first_of_its_zones():
    inner, outer = Zone((0, 0, 0), (1, 1, 1), 0.1), Zone((-1, -1, -1), (2, 2, 2), 0.3)
    forcing = SeaForcing(shallow_sea(1.0, current=(1.0, 0.0)), spacing=0.1, zones=[inner, outer])
    velocity = np.zeros((3, 3), np.float32)
    forcing.apply(view([(0.5, 0.5, 0.5), (1.5, 0.5, 0.5), (3.0, 0.5, 0.5)], velocity, 0.05))
    assert velocity[0] == pytest.approx([1 - math.exp(-0.5), 1 - math.exp(-0.05 / 0.3), 0.0], rel=1e-6)


def test_a_zone_with_an_edge_rises_smoothly_from_its_sides():
    graded, sharp = Zone((0, -1, 0), (4, 9, 1), 0.5, edge=1.0), Zone((0, -1, 0), (4, 9, 1), 0.5)
    position = np.zeros((3, 5), np.float32)
    position[0], position[1] = (0.0, 0.5, 1.0, 2.0, 4.0), 4.0
    share = graded.share(0.1, position)
    assert share == pytest.approx([0.0, 1.0 - np.exp(-0.1 / 0.5 * 0.5), *[float(sharp.share(0.1, position))] * 2, 0.0])


def test_zones_that_cannot_be_are_refused():
    for time in (0.0, -1.0):
        with pytest.raises(ValueError, match=rf"zone: relaxation_time is {time}, allowed: above 0 s"):
            Zone((0, 0, 0), (1, 1, 1), time)
    with pytest.raises(ValueError, match=r"zone: lower is \(1, 0, 0\) m, allowed: below upper = \(0, 1, 1\) m"):
        Zone((1, 0, 0), (0, 1, 1))
    with pytest.raises(ValueError, match=r"zone: lower is \(0, 0\), .* allowed: three numbers each"):
        Zone((0, 0), (1, 1))
    with pytest.raises(ValueError, match="edge"):
        Zone((0, 0, 0), (1, 1, 1), edge=-1.0)


@pytest.mark.parametrize("spacing", [0.1, 0.05])
def test_the_force_of_the_wind_is_stress_times_area(make_fluid, spacing):
    fluid = make_fluid(particle_spacing=spacing, lower=(0, 0, -0.3), upper=(1, 1, 1), periodic=(True, True, False))
    walls = tank_walls((0, 0, 0), (1, 1, 1), spacing, sides=("-z",), periodic=(True, True, False))
    fluid.add_boundary(walls)
    fluid.add_particles(block((0, 0, 0), (1, 1, 0.4), spacing), phase="water")
    fluid.add_forcing(SeaForcing(shallow_sea(0.4, wind=(-BREEZE, 0.0)), spacing=spacing))
    fluid.advance(0.001)
    # on a lattice the slopes of the two top layers add up to 1.07 of the jump within the water
    assert fluid.momentum()[0] / 0.001 == pytest.approx(-wind_stress(BREEZE), rel=0.12)


@pytest.mark.parametrize(
    ("gradient", "moved"),
    [
        ((0.0, 0.0, -0.3), True), ((0.0, 0.0, 0.3), False), ((0.3, 0.0, 0.0), False), ((0.0, 0.0, -0.11), True), ((0.0, 0.0, -0.09), False),
        ((0.24, 0.0, -0.15), True), ((0.28, 0.0, -0.15), False),
    ],
)  # fmt: skip
def test_the_wind_finds_the_surface_that_faces_up(gradient, moved):
    """From a tenth of a unit [1/spacing] on, and up to 60 degrees off the vertical."""
    velocity = np.zeros((3, 1), np.float32)
    forcing = SeaForcing(shallow_sea(1.0, wind=(BREEZE, 0.0)), spacing=0.1)
    forcing.apply(view([(0.0, 0.0, 0.9)], velocity, 0.01, np.array(gradient) / 0.1))
    assert bool(velocity.any()) == moved


def test_gusts_drag_as_the_sea_has_them():
    """dv = dt rho_air C_D |U| U 2 |g| / rho, with U the wind of the sea at the place and time of each particle."""
    sea = shallow_sea(1.0, wind=(BREEZE, 0.0), gusts=KaimalGusts(intensity=0.3, seed=3))
    points, gradient = np.array([(0.0, 0.0, 0.95), (80.0, 0.0, 0.95)]), (0.0, 0.0, -5.0)
    for time in (0.0, 2.0):
        velocity = np.zeros((3, 2), np.float32)
        SeaForcing(sea, spacing=0.1).apply(view(points, velocity, 0.01, gradient, time))
        speed = sea.wind(points, time)[:, 0]
        assert velocity[0] == pytest.approx([0.01 * wind_stress(one) * 10.0 / 1025.0 for one in speed], rel=1e-5)
        assert abs(speed[1] - speed[0]) > 0.1


@pytest.mark.parametrize("kind", ["waves", "wind"])
@pytest.mark.parametrize("direction", [0.0, math.pi, -math.pi])
def test_what_runs_along_x_stays_in_the_plane(make_fluid, kind, direction):
    # sin(pi) is 1.2e-16
    fluid = make_fluid(dimension=2, lower=(0, -1, 0), upper=(2, 1, 2))
    fluid.add_particles(block((0, 0, 0), (2, 0, 1), 0.1, 2), phase="water")
    waves = RegularWaves(height=0.1, period=1.0, direction=direction) if kind == "waves" else None
    wind = (math.copysign(5.0, math.cos(direction)), 0.0) if kind == "wind" else None
    fluid.add_forcing(SeaForcing(shallow_sea(1.0, wind=wind, waves=waves), spacing=0.1, zones=[EVERYWHERE]))
    fluid.advance(0.02)
    assert not fluid.state.velocity[1].any()
    if kind == "wind":
        assert np.sign(fluid.momentum()[0]) == round(math.cos(direction))


def test_what_leaves_the_plane_is_refused(make_fluid):
    fluid = make_fluid(dimension=2, lower=(0, -1, 0), upper=(2, 1, 2))
    fluid.add_particles([(1, 0, 1)], phase="water")
    fluid.add_forcing(current_in(Zone((0, -1, 0), (2, 1, 2)), (0.0, 0.3)))
    with pytest.raises(ValueError, match="SeaForcing moves liquid along y, allowed: x and z in two dimensions"):
        fluid.advance(0.01)


def test_lost_shear_comes_back_and_no_momentum_with_it():
    forcing = SeaForcing(shallow_sea(0.8, wind=(0.0, BREEZE), drift=WindDrift()), spacing=0.1)
    points = np.zeros((8, 3))
    points[:, 2] = np.linspace(0.05, 0.75, 8)
    velocity = np.zeros((3, 8), np.float32)
    velocity[:2] = forcing.drift(points[:, 2], 0.0).T
    assert velocity[1, -1] == pytest.approx(forcing.sea.wind_drift(0.0, 0.0)[1]) and not velocity[0].any()
    even = velocity.copy()
    even[1] = velocity[1].mean()
    kept = velocity.copy()
    forcing.apply(view(points, kept, 0.01))
    np.testing.assert_allclose(kept, velocity, atol=1e-6)  # the drift as it is needs nothing
    for _ in range(500):
        forcing.apply(view(points, even, 0.01))
    np.testing.assert_allclose(even, velocity, atol=0.01 * velocity.max())
    assert even[1].mean() == pytest.approx(velocity[1].mean(), abs=1e-6)


def test_oil_drifts_with_the_surface_of_the_sea(make_fluid):
    """10 m/s carry oil by 0.2 m/s, 0.53 u* (Wu 1975); in a periodic sea of five layers, over 4 s: 0.8 m, within a sixth."""
    d, level, size = 0.1, 0.5, (0.9, 0.9, 1.0)
    phases = (
        Phase(name="sea", rest_density=1025.0, dynamic_viscosity=1e-3),
        Phase(name="oil", rest_density=840.0, dynamic_viscosity=1e-2),
    )
    fluid = make_fluid(
        particle_spacing=d, phases=phases, lower=(0.0, 0.0, -d), upper=size, periodic=(True, True, False), maximum_time_step=0.02
    )  # fmt: skip
    fluid.add_boundary(tank_walls((0.0, 0.0, 0.0), size, d, sides=("-z",), periodic=(True, True, False)))
    forcing = SeaForcing(shallow_sea(level, wind=(BREEZE, 0.0), drift=WindDrift()), spacing=d)
    axis = (np.arange(9) + 0.5) * d
    grid = np.stack(np.meshgrid(axis, axis, axis[:6], indexing="ij"), axis=-1).reshape(-1, 3)
    slick = (grid[:, 2] > level) & (np.abs(grid[:, :2] - 0.45) < 0.2).all(axis=1)
    for phase, points in (("sea", grid[grid[:, 2] < level]), ("oil", grid[slick])):
        fluid.add_particles(points, phase=phase, velocity=np.pad(forcing.drift(points[:, 2], 0.0), ((0, 0), (0, 1))))
    fluid.add_forcing(forcing)
    way = 0.0
    for _ in range(200):
        fluid.advance(0.02)
        way += 0.02 * float(fluid.phase_velocities("oil")[:, 0].mean())
    assert way == pytest.approx(4.0 * forcing.sea.wind_drift(0.0, 0.0)[0], rel=1.0 / 6.0)
