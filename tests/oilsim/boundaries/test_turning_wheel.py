"""A wheel without friction turns freely in the surface of water."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import FluidConfig, Phase, block, tank_walls
from oilsim.fluid.fluid import Fluid
from tests.validation.rigid import disc

RADIUS, SPEED, WIDTH = 0.3, 1.0, 1.4  # m, rad/s, m


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spacing", "height", "depth"), [(0.1, 0.6, 0.6), (0.05, 0.6, 0.6), (0.025, 0.6, 0.6), (0.05, 0.5, 1.0)]
)
def test_water_does_not_turn_a_wheel_without_friction(spacing: float, height: float, depth: float) -> None:
    """Pressure acts along normals, which meet the axis; sums over particles braked it by 0.4 to 0.6 rho g d^2 at the rim in the surface."""
    fluid = Fluid(
        FluidConfig(
            particle_spacing=spacing, phases=(Phase(name="water", rest_density=1000.0),), lower=(-0.4, 0.0, -0.4), upper=(1.8, 1.0, 2.0),
            dimension=2,
        ),
        1,
    )  # fmt: skip
    fluid.add_boundary(tank_walls((0, 0, 0), (WIDTH, 0, 1.5), spacing, sides=("-x", "+x", "-z"), dimension=2))
    points, middle = block((0, 0, 0), (WIDTH, 0, depth), spacing, 2), np.array([WIDTH / 2, 0.0, height])
    points += 0.2 * spacing * np.random.default_rng(0).uniform(-1.0, 1.0, points.shape) * (1, 0, 1)
    outside = np.linalg.norm(points - middle, axis=1) > RADIUS + 0.5 * spacing
    fluid.add_particles(points[outside], phase="water")
    handle, torque = fluid.add_boundary(disc(RADIUS, spacing)), []
    for n in range(100):
        half = 0.01 * n * SPEED
        fluid.set_boundary_motion(handle, middle, (0, np.sin(half), 0, np.cos(half)), (0, 0, 0), (0, SPEED, 0))
        fluid.advance(0.02)
        torque.append(fluid.boundary_wrench(handle)[4])
    fluid.close()
    assert np.abs(torque).max() < 1e-4 * 9810.0 * spacing**2 * RADIUS
