"""Loads on bodies in well-balanced water do not depend on the step, and water gets what bodies give."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from coupling.solids.surface_sampling import boundary_particles
from oilsim import Fluid, FluidConfig, Phase, block, solid_box, tank_walls
from oilsim.pressure.rest_pressure import SHARE, RestLaw
from oilsim.stages.pressure import lift_of_rest

WATER = Phase(name="water", rest_density=1000.0, dynamic_viscosity=1e-3)
SPACING, RADIUS, SWAY, PERIOD = 0.25, 0.75, 0.08, 2.0  # m, m, m, s
DISPLACED = 1000.0 * 4.0 / 3.0 * np.pi * RADIUS**3  # kg
TURNED = (0.0, np.sin(0.3), 0.0, np.cos(0.3))


def basin(longest_step: float) -> Fluid:
    """A basin of 6 m by 6 m, 4 m deep, that repeats, with a floor."""
    lower, upper = (-3.0, -3.0, -4.0), (3.0, 3.0, 0.0)
    fluid = Fluid(
        FluidConfig(
            particle_spacing=SPACING, phases=(WATER,), lower=(-3.0, -3.0, -4.25), upper=(3.0, 3.0, 3.0),
            periodic=(True, True, False), maximum_time_step=longest_step, well_balanced=True,
        ),
        1,
    )  # fmt: skip
    walls = tank_walls(lower, upper, SPACING, sides=("-z",), periodic=(True, True, False))
    fluid.add_boundary(walls)
    points = block(lower, upper, SPACING)
    away = np.linalg.norm(points - (0.0, 0.0, -2.0), axis=1) > RADIUS + 0.5 * SPACING
    fluid.add_particles(points[away], phase="water")
    return fluid


def swayed(fluid: Fluid, step: float, ball) -> tuple[float, float]:
    """Return the added mass over what a swaying ball displaces, and the momentum that goes lost over what passes."""
    handle, omega = fluid.add_boundary(ball), 2.0 * np.pi / PERIOD
    found, lost, passed = [], 0.0, 0.0
    for n in range(round(3.0 * PERIOD / step)):
        time = n * step
        place, speed = SWAY * (1.0 - np.cos(omega * time)), SWAY * omega * np.sin(omega * time)
        gain = (SWAY * omega * np.sin(omega * (time + step)) - speed) / step
        fluid.set_boundary_motion(
            handle, (place, 0.0, -2.0), (0, 0, 0, 1), (speed, 0, 0), (0, 0, 0), np.zeros((6, 6)), (gain, 0, 0, 0, 0, 0)
        )
        before = fluid.particles.velocity[0].sum(dtype=np.float64)
        fluid.advance(step)
        force = fluid.boundary_wrench(handle)[0]
        given = 1000.0 * SPACING**3 * (fluid.particles.velocity[0].sum(dtype=np.float64) - before)
        lost, passed = lost + abs(force * step + given), passed + abs(force * step)
        found.append((gain, force))
    gains, forces = np.array(found)[-round(2.0 * PERIOD / step) :].T
    return -float(gains @ forces / (gains @ gains)) / DISPLACED, lost / passed


@pytest.mark.slow
def test_a_swaying_ball_has_one_added_mass_in_all_steps() -> None:
    """Half of what it displaces (Lamb 1932, sec. 92), a fifth more at six spacings; in long steps water gets all that the ball gives."""
    ball = boundary_particles("ball", trimesh.creation.icosphere(4, RADIUS), SPACING)
    found, lost = {}, {}
    for step in (0.1, 0.05, 0.025):
        fluid = basin(step)
        found[step], lost[step] = swayed(fluid, step, ball)
        fluid.close()
    forces = 1.0 + np.array(list(found.values()))  # with that of the sea's own acceleration, which no particles carry
    assert np.ptp(forces) < 0.05 * forces.mean()
    assert min(found.values()) > 0.5 and max(found.values()) < 0.65
    assert (
        lost[0.1] < 0.01
    )  # where nearly all pressure acts by its slope; the floor's points brake water in shorter ones


@pytest.mark.parametrize("name", ["ball", "box", "plate"])
def test_water_at_rest_lifts_a_solid_by_what_it_displaces(name: str) -> None:
    """The part of the pressure that acts by its slope, below its top, as hydrostatics have it: no side force, however it is turned."""
    mesh = trimesh.creation.box((2.0, 1.0, 1.5)) if name == "box" else trimesh.creation.icosphere(4, RADIUS)
    solid = boundary_particles(name, mesh, SPACING)
    volume = float(mesh.volume)
    if name == "plate":
        solid, volume = solid_box((2.0, 1.0, SPACING), SPACING), 2.0 * SPACING
    fluid = basin(0.1)
    handle = fluid.add_boundary(solid)
    fluid.set_boundary_motion(handle, (0.1, 0.2, -2.0), TURNED, (0, 0, 0), (0, 0, 0))
    fluid.context.walls.place()
    law = RestLaw(0.0, SPACING, 0.981)
    impulse = lift_of_rest(fluid.context, law, np.zeros(1, np.uint32))[0]
    weight = fluid.config.phases[0].rest_density * volume * SHARE * 0.981
    assert impulse[2] == pytest.approx(weight, rel=0.01)
    assert not impulse[:2].any() and impulse[5] == 0.0
    assert np.abs(impulse[3:5]).max() < 0.01 * weight * RADIUS
    assert not lift_of_rest(fluid.context, law, np.empty(0, np.uint32)).any()  # one that no water touches
    fluid.close()
