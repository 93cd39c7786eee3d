"""Viscosity meets gravity and pressure in balance: thick liquid that sticks to its walls lies still under its own weight."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import Fluid, FluidConfig, Phase, block, tank_walls

SPACING, SIDE, DENSITY, GRAVITY = 0.02, 0.24, 970.0, 9.81


@pytest.mark.parametrize("longest_step", [0.01, 0.005])
@pytest.mark.parametrize("viscosity", [0.373, 10.0])
def test_thick_liquid_at_rest_between_no_slip_walls_stays_at_rest(viscosity: float, longest_step: float) -> None:
    # gravity that acted alone before viscosity left oil of 10 Pa s at 33 mm/s in steps of 10 ms, and its pressure 3.4 % too low
    oil = Phase(name="oil", rest_density=DENSITY, dynamic_viscosity=viscosity)
    config = FluidConfig(
        particle_spacing=SPACING, phases=(oil,), lower=(-0.1, -1.0, -0.1), upper=(0.5, 1.0, 0.6), dimension=2,
        maximum_time_step=longest_step,
    )  # fmt: skip
    fluid = Fluid(config, threads=1)
    sides = ("-x", "+x", "-z")
    fluid.add_boundary(tank_walls((0, 0, 0), (SIDE, 0, 2 * SIDE), SPACING, sides=sides, dimension=2, no_slip=True))
    fluid.add_particles(block((0, 0, 0), (SIDE, 0, SIDE), SPACING, 2), phase="oil")
    speeds = []
    for n in range(60):
        fluid.advance(0.01)
        if n >= 30:
            speeds.append(float((fluid.particles.velocity.astype(np.float64) ** 2).sum(axis=0).mean()))
    assert np.sqrt(np.mean(speeds)) < 2e-3 * np.sqrt(GRAVITY * SIDE)
    depth = SIDE - 1.5 * SPACING
    pressure = fluid.pressure_at([[0.5 * SIDE, 0.0, 1.5 * SPACING]])[0]
    assert pressure == pytest.approx(DENSITY * GRAVITY * depth, rel=0.01)
