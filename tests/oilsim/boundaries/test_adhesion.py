"""The factor of adhesion's energy by its definition: tearing a half space of liquid off a plane costs w an area."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from oilsim import BoundaryParticles, Phase, block, tank_walls
from oilsim.boundaries.adhesion import adhesion_scale
from oilsim.fluid.schemes import attract
from oilsim.neighborhood.smoothing_kernels import SUPPORT
from tests.oilsim.conftest import search


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_energy_of_a_wall_particle_in_a_half_space_is_one(dimension: int) -> None:
    """Summed over shells about the wall particle: r (r - 1/2) 2 pi of a sphere, 2 r acos(1 / 2 r) of a circle lie in the liquid."""

    def shell(r: float) -> float:
        inside = 2.0 * math.pi * (r - 0.5) if dimension == 3 else 2.0 * math.acos(0.5 / r)
        return r * inside * (1.0 - r / SUPPORT) ** 2 * (1.0 + 2.0 * r / SUPPORT)

    energy = adhesion_scale.__wrapped__(dimension) * quad(shell, 0.5, SUPPORT)[0]
    assert energy == pytest.approx(1.0, rel=1e-4)
    assert adhesion_scale(dimension) == adhesion_scale.__wrapped__(dimension)


def adhesive_fluid(make_fluid, work_of_adhesion):
    oil = Phase(name="oil", rest_density=900.0, adhesion=work_of_adhesion)
    return make_fluid(
        phases=(oil,),
        particle_spacing=0.1,
        lower=(0, 0, -0.5),
        upper=(1, 1, 2),
        periodic=(True, True, False),
        gravity=(0, 0, 0),
    )


def test_tearing_oil_off_a_plane_costs_the_work_of_adhesion(make_fluid):
    lift = np.linspace(0.0, 0.2, 41)
    forces = []
    for height in lift:
        fluid = adhesive_fluid(make_fluid, 0.07)
        fluid.add_boundary(tank_walls((0, 0, 0), (1, 1, 1), 0.1, sides=("-z",), periodic=(True, True, False)))
        fluid.add_particles(block((0, 0, height), (1, 1, 0.5 + height), 0.1), phase="oil")
        search(fluid)
        attract(fluid.context, fluid.clock, fluid.arrays, fluid.state, 1.0)
        forces.append(-fluid.momentum()[2])
    # one layer of lattice within reach stands for the integral: midpoint rule over three layers, 15 %
    assert np.trapezoid(forces, lift) == pytest.approx(0.07 * 1.0, rel=0.15)


def test_adhesion_pulls_the_body_as_it_pulls_the_oil(make_fluid):
    fluid = adhesive_fluid(make_fluid, 0.07)
    points = block((-0.2, -0.2, -0.05), (0.2, 0.2, 0.05), 0.1)
    handle = fluid.add_boundary(
        BoundaryParticles(
            name="plate", position=points, volume=np.full(len(points), 4e-4), area=np.full(len(points), 0.01)
        )
    )
    inverse_mass = np.diag([0.5] * 3 + [2.0] * 3)
    fluid.set_boundary_motion(handle, (0.5, 0.5, 0.72), (0, 0, 0, 1), (0, 0, 0), (0, 0, 0), inverse_mass)
    fluid.add_particles(block((0.2, 0.2, 0.4), (0.8, 0.8, 0.6), 0.1), phase="oil")
    search(fluid)
    attract(fluid.context, fluid.clock, fluid.arrays, fluid.state, 0.01)
    body = fluid.context.walls.moving[handle]
    assert body.impulse[2] < -1e-5
    assert body.impulse[:3] == pytest.approx(-fluid.momentum(), rel=1e-4, abs=1e-9)
