"""Parcels follow Fay's laws, and their grid keeps volume and slicks apart."""

from __future__ import annotations

import math

import numpy as np
import pytest

from oilsim.slick import gradient_flow
from oilsim.slick.gradient_flow import PER_CELL, Liquids, _measure, cell_size
from oilsim.slick.oil import Oil
from oilsim.slick.slick import Slick, SlickSettings
from oilsim.slick.thickness_grid import build_grid
from tests.oilsim.slick.flows import UniformFlow

CALM = UniformFlow()
WATER, VISCOSITY = 1025.0, 1e-6


def radius_of(slick: Slick) -> float:
    """Radius of a disc with the profile (1 - r^2 / R^2)^(1/2) and the parcels' second moment, 2/5 R^2."""
    parcels = slick.parcels
    offset = parcels.position - np.average(parcels.position, axis=0, weights=parcels.volume)
    return math.sqrt(2.5 * float(np.average((offset**2).sum(axis=1), weights=parcels.volume)))


def spread_slick(law, start: float, end: float, steps: int, volume: float, density: float, tension: float) -> Slick:
    """A slick of 2500 parcels that starts on a law and spreads in equal steps."""
    oil = Oil(density=density, dynamic_viscosity=0.02, interfacial_tension=0.02, spreading_tension=tension)
    slick = Slick(SlickSettings(loss_volume=1.0, water_density=WATER, water_viscosity=VISCOSITY))
    slick.release(oil, volume, count=2500, center=(300.0, -70.0), radius=law(start), age=start)
    for step in range(steps):
        slick.step(CALM, start + step * (end - start) / steps, (end - start) / steps)
    return slick


CASES = {
    "gravity-inertia": (lambda t: gradient_flow.gravity_inertia_radius(t, 1e4, 1 - 875 / WATER), 10.0, 60.0, 1e4, 875.0, 0.0),
    "gravity-viscous": (
        lambda t: gradient_flow.gravity_viscous_radius(t, 5.0, 1 - 875 / WATER, VISCOSITY), 600.0, 3600.0, 5.0, 875.0, 0.0,
    ),
    "surface tension": (
        lambda t: gradient_flow.surface_tension_radius(t, 0.01, WATER, VISCOSITY), 1800.0, 5400.0, 1.0, 1024.9, 0.01,
    ),
}  # fmt: skip


@pytest.mark.parametrize("regime", CASES)
def test_parcels_follow_the_law(regime):
    """Radius over a decade or half of one of the area within 2 %, volume to round-off, the center at rest."""
    law, start, end, volume, density, tension = CASES[regime]
    slick = spread_slick(law, start, end, 150, volume, density, tension)
    assert radius_of(slick) == pytest.approx(law(end), rel=0.02)
    assert law(end) > 1.5 * law(start)
    assert abs(slick.oil.residual) < 1e-14 * volume * len(slick.parcels)
    assert np.allclose(slick.parcels.position.mean(axis=0), (300.0, -70.0), atol=0.01 * law(end))
    others = [other[0](end) for name, other in CASES.items() if name != regime]
    assert all(abs(radius_of(slick) / other - 1.0) > 0.1 for other in others)


def test_profile_is_that_of_the_solution():
    """Halfway out, h = h_0 (1 - 1/4)^(1/2) with h_0 = 3 V / (2 pi R^2), within the noise of parcels."""
    law, start, end, volume, density, tension = CASES["gravity-viscous"]
    slick = spread_slick(law, start, end, 100, volume, density, tension)
    away = np.hypot(*(slick.parcels.position - (300.0, -70.0)).T) / law(end)
    deepest = 1.5 * volume / (math.pi * law(end) ** 2)
    for r in (0.1, 0.5, 0.8):
        ring = np.abs(away - r) < 0.05
        assert slick.parcels.thickness[ring].mean() == pytest.approx(deepest * math.sqrt(1 - r * r), rel=0.05)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_grid_keeps_volume(seed):
    """Sum over cells of thickness times area is the parcels' volume, rims and far blocks included."""
    random = np.random.default_rng(seed)
    position = random.normal(0.0, 30.0, (800, 2)) + random.choice([-5000.0, 0.0, 700.0], (800, 1))
    volume, cell = random.random(800), 1.7
    grid = build_grid(position, volume, cell)
    blocks = grid.thickness.reshape(-1, 18, 18)[:, 1:-1, 1:-1]
    assert blocks.sum() * cell * cell == pytest.approx(volume.sum(), rel=1e-13)


def test_slicks_that_do_not_touch_spread_by_their_own_volume():
    """Alone or 500 m from a larger one, a slick's mobility is the same; as one slick it would not be."""
    random = np.random.default_rng(4)
    small, large = random.normal(0.0, 5.0, (300, 2)), random.normal(500.0, 20.0, (600, 2))

    def mobilities(position, volume):
        columns = np.stack(
            [volume, np.full(len(volume), 875.0), np.full(len(volume), 0.01), np.full(len(volume), 60.0)]
        )
        measured = _measure(position, columns, 2.0, Liquids(WATER, VISCOSITY))
        return measured.mobility[measured.slick[measured.grid.cells]]

    volumes = np.repeat([0.01, 0.2], [300, 600])
    together = mobilities(np.concatenate([small, large]), volumes)
    core = np.hypot(*small.T) < 5.0
    assert (together[:300][core] == mobilities(small, volumes[:300])[core]).all()
    assert together[:300][core].max() != together[300:].max()


def test_long_steps_follow_the_law_too():
    """Where a step would need many parts, wider cells take their place; 10 steps instead of 150 are 3 % off at most."""
    law, start, end, volume, density, tension = CASES["gravity-viscous"]
    slick = spread_slick(law, start, end, 10, volume, density, tension)
    assert radius_of(slick) == pytest.approx(law(end), rel=0.03)


def test_oil_as_dense_as_water_is_refused():
    slick = Slick(SlickSettings(loss_volume=1.0))
    heavy = Oil(density=1030.0, dynamic_viscosity=1.0, interfacial_tension=0.02)
    with pytest.raises(ValueError, match=r"density is 1030 kg/m3, allowed: below 1027"):
        slick.release(heavy, 1.0, count=10, center=(0.0, 0.0), radius=1.0)


def test_scattered_parcels_stay_finite():
    """One litre as 40 parcels strewn over 2000 km: each lies in a patch of its own final area, and counts as such where it is thinner."""
    random = np.random.default_rng(5)
    slick = Slick(SlickSettings(loss_volume=1.0, water_density=WATER, water_viscosity=VISCOSITY))
    oil = Oil(density=875.0, dynamic_viscosity=0.02, interfacial_tension=0.02, spreading_tension=0.01)
    slick.release(oil, 1e-3, count=40, center=(0.0, 0.0), radius=1.0, age=60.0)
    parcels = slick.parcels
    parcels.position[:] = random.uniform(-1e6, 1e6, parcels.position.shape)
    for step in range(50):
        slick.step(CALM, step * 60.0, 60.0)
    assert np.isfinite(parcels.position).all() and np.isfinite(parcels.thickness).all()
    assert (np.abs(parcels.position) < 1.1e6).all()
    volume = np.full(40, 1e-3 / 40)
    final = volume / (1e5 * volume**0.75)
    np.testing.assert_allclose(parcels.thickness, final, rtol=1e-12)
    assert cell_size(volume, np.full(40, 1e-15)) == pytest.approx(math.sqrt(PER_CELL * volume[0] / final[0]))
    assert cell_size(volume, np.full(40, 1e-3)) == pytest.approx(math.sqrt(PER_CELL * volume[0] / 1e-3))
