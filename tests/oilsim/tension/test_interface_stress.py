"""Interfacial tension: how strongly interfaces pull, momentum, a drop's pressure, and what is refused."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from oilsim import FluidConfig, Phase, block, solid_box, tank_walls
from oilsim.core.config import STABLE
from oilsim.fluid.schemes import attract
from oilsim.neighborhood.smoothing_kernels import SUPPORT, kernel, lattice_stiffness
from oilsim.tension.interface_stress import smooth_tensions
from tests.oilsim.conftest import disturbed, prepare

SIGMA, RADIUS, SPACING = 0.05, 1.2, 0.1
WATER = Phase(name="water", rest_density=1000.0)
OIL = Phase(name="oil", rest_density=850.0, interfacial_tension=SIGMA)
ROOM = {"lower": (-3.0,) * 3, "upper": (3.0,) * 3, "gravity": (0.0, 0.0, 0.0), "dimension": 2}


def pulled(fluid):
    """Forces [N] (3, N) of tension on the particles at rest, and their places [m] (3, N)."""
    prepare(fluid)
    fluid.state.velocity[:] = 0.0
    attract(fluid.context, fluid.clock, fluid.arrays, fluid.state, 1.0)
    mass = fluid.config.rest_volume * fluid.arrays.neighbors.rest_density
    return mass * fluid.state.velocity.astype(np.float64), fluid.state.position.astype(np.float64)


def with_drop(fluid, points):
    """Fill `points` (N, 3) [m] with water, and with oil where they are within the radius; returns how many are oil."""
    inside = np.hypot(points[:, 0], points[:, 2]) < RADIUS
    fluid.add_particles(points[inside], phase="oil")
    fluid.add_particles(points[~inside], phase="water")
    return np.count_nonzero(inside)


@pytest.mark.parametrize("seed", [None, 1])
def test_interface_of_a_drop_pulls_with_sigma_a_metre(make_fluid, seed):
    """The virial of the forces is minus the integral of the stress, sigma times the circumference."""
    fluid = make_fluid(phases=(OIL, WATER), **ROOM)
    points = block((-2.5, 0, -2.5), (2.5, 0, 2.5), SPACING, 2)
    if seed is not None:
        points = disturbed(points, 0.05 * SPACING, seed) * [1, 0, 1]
    radius = math.sqrt(with_drop(fluid, points) * SPACING**2 / math.pi)
    force, place = pulled(fluid)
    assert (force * place).sum() == pytest.approx(-SIGMA * 2.0 * math.pi * radius, rel=0.03)


def test_tension_is_smoothed_as_the_kernel_says(make_fluid):
    """a_i = sum_j W_ij s_j / sum_j W_ij, in three dimensions and with i itself among the j; by sums over all pairs in double precision."""
    fluid = make_fluid(phases=(OIL, WATER), **(ROOM | {"dimension": 3}))
    points = disturbed(block((-0.4,) * 3, (0.4,) * 3, SPACING), 0.1 * SPACING, 4)
    oily = points @ [0.5, 0.3, 1.0] > 0.05
    for chosen, name in ((oily, "oil"), (~oily, "water")):
        fluid.add_particles(points[chosen], phase=name)
    prepare(fluid)
    place = fluid.state.position.T.astype(np.float64)
    tension = np.where(fluid.state.phase == 0, SIGMA, 0.0).astype(np.float32)
    q = np.linalg.norm(place[:, None] - place, axis=2) / (SUPPORT * SPACING)
    weight = kernel(q, 1.0)
    smoothed = np.empty(len(place), np.float32)
    smooth_tensions(0, len(place), fluid.arrays.neighbors.neighborhood, tension, smoothed)
    assert smoothed == pytest.approx(weight @ tension / weight.sum(axis=1), rel=1e-5, abs=1e-5 * SIGMA)


def test_drop_is_under_the_pressure_of_laplace(make_fluid):
    side = {"lower": (-2.4, -1.0, -2.4), "upper": (2.4, 1.0, 2.4), "periodic": (True, False, True)}
    strong = Phase(name="oil", rest_density=1000.0, dynamic_viscosity=100.0, interfacial_tension=500.0)
    thick = Phase(name="water", rest_density=1000.0, dynamic_viscosity=100.0)
    fluid = make_fluid(phases=(strong, thick), **(ROOM | side))
    points = block((-2.4, 0, -2.4), (2.4, 0, 2.4), SPACING, 2)
    radius = math.sqrt(with_drop(fluid, points) * SPACING**2 / math.pi)
    fluid.advance(0.5)
    distance = np.hypot(points[:, 0], points[:, 2])
    inside, outside = (fluid.pressure_at(points[chosen]).mean() for chosen in (distance < 0.8, distance > 1.6))
    assert inside - outside == pytest.approx(500.0 / radius, rel=0.05)
    assert outside > 0.4 * 500.0 / SPACING  # no pull along the interface


@pytest.mark.parametrize("angle", [90.0, 35.0])
def test_pull_keeps_momentum_with_a_body(make_fluid, angle):
    fluid = make_fluid(phases=(OIL, WATER), **ROOM)
    points = disturbed(block((-1, 0, -1), (1, 0, 1), SPACING, 2), 0.1 * SPACING, 3) * [1, 0, 1]
    points = points[(np.abs(points[:, 0]) > 0.35) | (np.abs(points[:, 2]) > 0.25)]
    fluid.add_particles(points[points[:, 2] < 0.0], phase="water")
    fluid.add_particles(points[points[:, 2] >= 0.0], phase="oil")
    body = fluid.add_boundary(replace(solid_box((0.6, 0.1, 0.4), SPACING, dimension=2), contact_angle=angle))
    fluid.set_boundary_motion(body, (0, 0, 0), (0, 0, 0, 1), (0, 0, 0), (0, 0, 0))
    force, _ = pulled(fluid)
    impulse = fluid.context.walls.moving[body].impulse
    scale = np.abs(force).sum()
    assert scale > 0.1 * SIGMA
    assert np.linalg.norm(impulse[:3]) > 1e-3 * scale
    assert np.abs(force.sum(axis=1) + impulse[:3]).max() < 1e-6 * scale


@pytest.mark.parametrize("angle", [0.0, 50.0, 90.0, 180.0])
def test_wall_pulls_along_itself_by_the_law_of_young(make_fluid, angle):
    """A wall under oil on the left and water on the right pulls them to the right by sigma cos(theta) a metre."""
    fluid = make_fluid(phases=(OIL, WATER), **ROOM)
    floor = tank_walls((-2.0, 0.0, 0.0), (2.0, 0.0, 1.0), SPACING, sides=("-z",), dimension=2)
    fluid.add_boundary(replace(floor, contact_angle=angle))
    fluid.add_particles(block((-2, 0, 0), (0, 0, 1), SPACING, 2), phase="oil")
    fluid.add_particles(block((0, 0, 0), (2, 0, 1), SPACING, 2), phase="water")
    force, place = pulled(fluid)
    middle = np.abs(place[0]) < 1.0
    # pairs of particles cancel, so their sum is the pull of the wall
    assert force[0, middle].sum() == pytest.approx(SIGMA * math.cos(math.radians(angle)), abs=0.01 * SIGMA)
    assert np.abs(force[:, (place[2] > 0.4) & (place[2] < 0.6)]).max() < 1e-3 * SIGMA


def test_flat_interface_feels_nothing_and_a_free_surface_has_no_tension(make_fluid):
    fluid = make_fluid(phases=(OIL, WATER), **ROOM)
    fluid.add_particles(block((-2, 0, -1), (2, 0, 0), SPACING, 2), phase="water")
    fluid.add_particles(block((-2, 0, 0), (2, 0, 1), SPACING, 2), phase="oil")
    force, place = pulled(fluid)
    assert np.abs(force[:, np.abs(place[0]) < 0.9]).max() < 1e-3 * SIGMA
    assert np.abs(force[:, np.abs(place[2]) > 0.8]).max() < 1e-6 * SIGMA
    assert np.abs(force).max() > 0.1 * SIGMA


def test_liquid_without_tension_has_no_stage(make_fluid):
    fluid = make_fluid(phases=(WATER,), **ROOM)
    fluid.add_particles(block((-0.5, 0, -0.5), (0.5, 0, 0.5), SPACING, 2), phase="water")
    report = fluid.advance(0.01)
    assert fluid.context.constants.tensions is None
    assert "tension" not in report.stage_seconds


def test_ripples_bound_the_step(make_fluid):
    strong = Phase(name="oil", rest_density=850.0, interfacial_tension=5.0)
    fluid = make_fluid(phases=(strong, WATER), **(ROOM | {"maximum_time_step": 1.0}))
    fluid.add_particles(block((-0.5, 0, -0.5), (0.5, 0, 0.5), SPACING, 2), phase="water")
    longest = math.sqrt(1850.0 * SPACING**3 / (4.0 * math.pi * 5.0))
    assert fluid.config.capillary_time_step == pytest.approx(longest)
    fluid.advance(10.0 * longest)
    assert fluid.state.step <= longest * (1.0 + 1e-6)


def test_light_air_shortens_the_step_by_the_pressure_that_keeps_its_interface_whole():
    air = Phase(name="air", rest_density=1.2, interfacial_tension=0.0728)
    config = FluidConfig(particle_spacing=0.001, phases=(WATER, air), minimum_time_step=1e-6, **ROOM)
    swings = math.sqrt(lattice_stiffness(2) * 0.8 * 0.0728 / 0.001 / 1.2) / 0.001  # 1/s
    assert config.capillary_time_step == pytest.approx(STABLE * 2.0 / swings)


@pytest.mark.parametrize(
    ("terms", "message"),
    [
        ({"scheme": "paper"}, "scheme is 'paper' with an interfacial_tension"),
        (
            {"sleep_speed": 0.01, "gravity": (0.0, 0.0, -9.81)},
            r"sleep_speed is 0\.01 m/s with an interfacial_tension",
        ),
        (
            {"minimum_time_step": 0.5, "maximum_time_step": 2.0, "particle_spacing": 0.01},
            r"minimum_time_step is 0\.5 s, allowed: up to 0\.05",
        ),
    ],
)
def test_settings_at_odds_with_tension_are_refused(terms, message):
    with pytest.raises(ValueError, match=message):
        FluidConfig(**({"particle_spacing": 0.1, "phases": (OIL, WATER)} | ROOM | terms))


@pytest.mark.parametrize("value", [-0.01, math.nan, "much"])
def test_impossible_tension_is_refused(value):
    with pytest.raises(ValueError, match="phase 'oil': interfacial_tension is"):
        Phase(name="oil", rest_density=850.0, interfacial_tension=value)


def test_light_air_around_a_drop_gives_its_surface_laplaces_pressure(make_fluid):
    radius, spacing, half = 0.005, 0.005 / 6, 0.0125
    water = Phase(name="water", rest_density=1000.0, dynamic_viscosity=0.05)
    air = Phase(name="air", rest_density=10.0, dynamic_viscosity=1e-3, interfacial_tension=0.0728)
    fluid = make_fluid(
        particle_spacing=spacing, phases=(water, air), dimension=2, gravity=(0.0, 0.0, 0.0), lower=(-half, -1.0, -half),
        upper=(half, 1.0, half), periodic=(True, False, True), minimum_time_step=1e-5,
    )  # fmt: skip
    points = block((-half, 0.0, -half), (half, 0.0, half), spacing, 2)
    inside = np.hypot(points[:, 0], points[:, 2]) < radius
    fluid.add_particles(points[inside], phase="water")
    fluid.add_particles(points[~inside], phase="air")
    fluid.advance(0.01)
    middle, corner = fluid.pressure_at([(0.0, 0.0, 0.0), (0.9 * half, 0.0, 0.9 * half)])
    effective = spacing * math.sqrt(np.count_nonzero(inside) / math.pi)
    assert middle - corner == pytest.approx(0.0728 / effective, rel=0.08)
    assert np.hypot(*fluid.phase_positions("water")[:, ::2].T).max() < 1.1 * radius
