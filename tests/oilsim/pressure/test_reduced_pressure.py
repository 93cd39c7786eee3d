"""One liquid that fills its box: weight is no part of what the solve finds, and is in all that is read."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coupling.solids.bodies import sphere
from coupling.solids.surface_sampling import boundary_particles
from oilsim import Fluid, FluidConfig, Phase, block, tank_walls
from oilsim.core.state import Confinement
from tests.oilsim.conftest import disturbed
from tests.validation.case import Bench
from tests.validation.rigid import CLEARANCE, Body, disc

GRAVITY, DENSITY, SIDE, SPACING, STEP = 9.81, 970.0, 0.4, 0.02, 0.005
OIL = Phase(name="oil", rest_density=DENSITY, dynamic_viscosity=0.4)
SIDES = ("-x", "+x", "-z", "+z")


def box(lean: float = 0.0, gravity: float = GRAVITY, periodic: bool = False) -> Fluid:
    """A square box in the plane; gravity leans by `lean` [rad] from straight down towards x. Empty."""
    room = 4.0 * SPACING
    fluid = Fluid(
        FluidConfig(
            particle_spacing=SPACING, phases=(OIL,), dimension=2, maximum_time_step=STEP, periodic=(periodic, False, False),
            lower=(0.0 if periodic else -room, -1.0, -room), upper=(SIDE if periodic else SIDE + room, 1.0, SIDE + room),
            gravity=(gravity * math.sin(lean), 0.0, -gravity * math.cos(lean)),
        ),
        threads=1,
    )  # fmt: skip
    sides = SIDES[2:] if periodic else SIDES
    fluid.add_boundary(
        tank_walls((0, 0, 0), (SIDE, 0, SIDE), SPACING, sides=sides, dimension=2, periodic=(periodic, False, False))
    )
    return fluid


def fill(fluid: Fluid, around: float = 0.0) -> None:
    """Fill the box with particles off their lattice, but for a disc in its middle of radius `around` [m]."""
    points = disturbed(block((0, 0, 0), (SIDE, 0, SIDE), SPACING, 2), 0.03 * SPACING, 1) * (1, 0, 1)
    points = np.clip(points, (0.2 * SPACING, 0, 0.2 * SPACING), (SIDE - 0.2 * SPACING, 0, SIDE - 0.2 * SPACING))
    away = np.linalg.norm(points - (0.5 * SIDE, 0, 0.5 * SIDE), axis=1) > around
    fluid.add_particles(points[away], phase="oil")


def disc_in(fluid: Fluid, density: float, radius: float = 4 * SPACING) -> Body:
    """A disc in the middle of the box, free to move up and down."""
    area = math.pi * radius**2
    body = Body(fluid, disc(radius, SPACING), density * area, np.zeros((3, 3)), np.array([0.5, 0.0, 0.5]) * SIDE)
    body.freedoms[2] = 1.0
    fill(fluid, radius + CLEARANCE * SPACING)
    return body


@pytest.mark.parametrize("lean", [0.0, 0.6])
def test_pressure_at_rest_is_read_whole_and_walls_bear_the_weight(lean: float) -> None:
    fluid = box(lean)
    budget = fluid.watch()
    fill(fluid)
    fluid.advance(0.2)
    down = np.array([math.sin(lean), 0.0, -math.cos(lean)])
    points = np.array([(0.1, 0.0, 0.3), (0.2, 0.0, 0.2), (0.3, 0.0, 0.1)])
    slope = np.diff(fluid.pressure_at(points)) / (DENSITY * GRAVITY * (np.diff(points, axis=0) @ down))
    assert slope == pytest.approx(1.0, abs=0.01)
    whole = fluid.particles.pressure_impulse - fluid.particles.pressure_impulse.min()
    depth = fluid.particles.position.T @ down
    assert np.polyfit(depth, whole, 1)[0] == pytest.approx(GRAVITY * fluid.state.time_step, rel=0.01)
    ledger = budget.total
    assert ledger is not None
    weight = DENSITY * fluid.particle_count * SPACING**2 * GRAVITY * ledger.duration
    assert ledger.wall_impulse[:3] == pytest.approx(-weight * down, abs=0.005 * weight)


def test_a_held_body_has_archimedes_lift_and_the_momentum_is_booked() -> None:
    fluid = box()
    body = disc_in(fluid, DENSITY)
    body.freedoms[:] = 0.0
    budget = fluid.watch()
    lift = [body.advance(Bench(threads=1), 0.02)[2] for _ in range(20)]
    area = math.pi * (4 * SPACING) ** 2
    assert np.mean(lift[10:]) == pytest.approx(DENSITY * GRAVITY * area, rel=0.01)
    assert budget.total is not None
    assert budget.total.momentum_residual < 1e-6


@pytest.mark.parametrize("step", [STEP, 0.5 * STEP])
@pytest.mark.parametrize("heavier", [1.01, 0.8])
def test_a_body_falls_as_one_that_its_excess_weight_draws_through_weightless_liquid(
    heavier: float, step: float
) -> None:
    """Gravity adds the weight of the displaced liquid to a body, and nothing else: the two runs are one."""
    speeds = []
    for gravity in (GRAVITY, 0.0):
        fluid = box(gravity=gravity)
        body = disc_in(fluid, heavier * DENSITY)
        drive = (1.0 - heavier) * DENSITY * GRAVITY * math.pi * (4 * SPACING) ** 2
        # `Body` falls under gravity: in weightless liquid the pull takes its weight off and leaves the excess
        pull = np.array([0.0, 0.0, 0.0 if gravity else body.mass * GRAVITY + drive, 0.0, 0.0, 0.0])
        for _ in range(round(0.2 / step)):
            body.advance(Bench(threads=1), step, pull)
        speeds.append(body.twist[2])
    assert abs(speeds[1]) > 0.002
    assert np.sign(speeds[1]) == np.sign(1.0 - heavier)
    assert speeds[0] == pytest.approx(speeds[1], rel=2e-3)


def test_a_surface_that_opens_and_closes_is_no_blow() -> None:
    """Taking liquid out gives the rest a free surface, and pressure is told as a whole from then on."""
    fluid = box()
    fill(fluid)
    fluid.advance(0.1)
    assert fluid.state.confinement == Confinement.FILLED
    assert fluid.state.is_reduced
    top = fluid.state.position[2] > SIDE - 4.0 * SPACING
    fluid.state.remove(top, fluid.context.team)
    fluid.advance(STEP)
    assert not fluid.state.is_reduced
    assert fluid.state.pressure_impulse.min() >= 0.0
    assert np.sqrt((fluid.state.velocity**2).sum(axis=0).mean()) < 0.01
    fluid.advance(0.1)
    deep = fluid.pressure_at([(0.2, 0.0, 0.1)])[0]
    assert deep == pytest.approx(DENSITY * GRAVITY * (SIDE - 4.0 * SPACING - 0.1), rel=0.05)
    fluid.add_particles(block((0, 0, SIDE - 4 * SPACING), (SIDE, 0, SIDE), SPACING, 2), phase="oil")
    fluid.advance(0.1)
    assert fluid.state.is_reduced
    assert np.sqrt((fluid.state.velocity**2).sum(axis=0).mean()) < 0.02


def test_gravity_along_an_endless_box_drives_the_flow() -> None:
    fluid = box(lean=math.pi / 2.0, periodic=True)  # no wall bears it
    fill(fluid)
    fluid.advance(0.05)
    assert fluid.state.confinement == Confinement.FILLED
    assert not fluid.state.is_reduced
    assert fluid.state.velocity[0].mean() == pytest.approx(0.05 * GRAVITY, rel=0.02)


def test_a_body_that_stands_out_of_the_box_keeps_the_whole_pressure() -> None:
    fluid = box()
    body = disc_in(fluid, DENSITY)
    body.position[2] = SIDE
    body.freedoms[:] = 0.0
    body.advance(Bench(threads=1), STEP)
    assert not fluid.state.is_reduced


@pytest.mark.parametrize("resolution", [4, 6, 9])
def test_what_a_body_displaces_is_its_mesh(resolution: int) -> None:
    mesh = sphere(0.5)
    whole = boundary_particles("ball", mesh, 1.0 / resolution).whole
    assert whole[:, 3].sum() == pytest.approx(mesh.volume, rel=1e-9)
