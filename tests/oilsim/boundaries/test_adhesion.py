"""The factor of adhesion's energy by its definition: tearing a half space of liquid off a plane costs w an area."""

from __future__ import annotations

import math

import pytest
from scipy.integrate import quad

from oilsim.boundaries.adhesion import adhesion_scale
from oilsim.neighborhood.smoothing_kernels import SUPPORT


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_energy_of_a_wall_particle_in_a_half_space_is_one(dimension: int) -> None:
    """Summed over shells about the wall particle: r (r - 1/2) 2 pi of a sphere, 2 r acos(1 / 2 r) of a circle lie in the liquid."""

    def shell(r: float) -> float:
        inside = 2.0 * math.pi * (r - 0.5) if dimension == 3 else 2.0 * math.acos(0.5 / r)
        return r * inside * (1.0 - r / SUPPORT) ** 2 * (1.0 + 2.0 * r / SUPPORT)

    energy = adhesion_scale.__wrapped__(dimension) * quad(shell, 0.5, SUPPORT)[0]
    assert energy == pytest.approx(1.0, rel=1e-4)
    assert adhesion_scale(dimension) == adhesion_scale.__wrapped__(dimension)
