"""The chain of closures: orderings that crews and flumes see, the band of practice, and where closures are off."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.constants import knot

from booms.losses.liquids import OilOnWater
from booms.losses.rates import Closures, Drivers
from booms.losses.resolution import Resolution
from oilsim.oil.fates import LossCause

OIL = OilOnWater(oil_density=900.0, water_density=1027.0, interfacial_tension=0.025)
CLOSURES = Closures(skirt_depth=0.4)


def drivers(speed=0.5, draft=0.4, held=0.3, lean=0.0, freeboard=0.3, sunk=False):
    rows = np.broadcast_arrays(*map(np.atleast_1d, (speed, draft, held, lean, freeboard, sunk)))
    names = ("speed", "draft", "held", "lean", "freeboard", "sunk")
    return Drivers(**{name: row.copy() for name, row in zip(names, rows, strict=True)})


def lost(closures=CLOSURES, oil=OIL, **values):
    return closures.rates(drivers(**values), oil).sum(axis=0)


def share_a_minute(speed_kn, held=0.3, oil=OIL, **closures):
    return 60.0 * float(lost(replace(CLOSURES, **closures), oil, speed=speed_kn * knot, held=held)[0]) / held


def test_a_boom_without_oil_or_flow_loses_none():
    assert not CLOSURES.rates(drivers(held=0.0), OIL).any()
    assert not CLOSURES.rates(drivers(speed=0.0), OIL).any()


def test_hardly_any_loss_at_half_a_knot_and_a_catastrophe_above_one_and_a_tenth():
    for density in (840.0, 900.0, 940.0):
        oil = replace(OIL, oil_density=density)
        assert share_a_minute(0.5, oil=oil) < 0.001
        assert share_a_minute(1.2, oil=oil) > 0.10


def test_faster_heavier_and_lower_tension_lose_more():
    speeds = lost(speed=np.array([0.38, 0.42, 0.46, 0.5, 0.6]))
    assert (np.diff(speeds) > 0.0).all()
    densities = [float(lost(oil=replace(OIL, oil_density=rho))[0]) for rho in (840.0, 870.0, 900.0, 940.0)]
    assert (np.diff(densities) > 0.0).all()
    tensions = [float(lost(oil=replace(OIL, interfacial_tension=sigma))[0]) for sigma in (0.03, 0.02, 0.015)]
    assert (np.diff(tensions) > 0.0).all()


@pytest.mark.parametrize("viscosity", [1e-5, 5e-3])
def test_no_oil_is_so_heavy_and_no_water_so_fast_that_less_is_lost(viscosity):
    """From 840 kg/m3 up to oil that hardly floats, and up to 1.5 m/s, thin and viscous: never less, and in the end all at once."""
    speeds, densities = np.linspace(0.1, 1.5, 57), [*np.arange(840.0, 1026.0, 5.0), 1026.0, 1026.9]
    oils = [replace(OIL, oil_density=rho, kinematic_viscosity=viscosity) for rho in densities]
    found = np.array(
        [[lost(replace(CLOSURES, skirt_depth=0.25), one, speed=u, draft=0.25)[0] for u in speeds] for one in oils]
    )
    assert (np.diff(found, axis=1) >= -1e-3 * found[:, :-1]).all()
    assert (np.diff(found, axis=0) >= -1e-3 * found[:-1]).all()  # droplets end where drainage begins
    assert 60.0 * found[-1, speeds > 0.5].min() / 0.3 > 10.0  # pools a minute


def test_a_leaning_skirt_and_a_thicker_pool_lose_more_by_drainage():
    lean = np.radians([0.0, 20.0, 40.0])
    found = CLOSURES.rates(drivers(speed=0.55, held=3.0, lean=lean, draft=0.3 * np.cos(lean)), OIL)[LossCause.DRAINAGE]
    assert (np.diff(found) > 0.0).all()
    found = CLOSURES.rates(drivers(speed=0.55, held=np.array([1.0, 3.0, 6.0]), draft=0.3), OIL)[LossCause.DRAINAGE]
    assert found[0] == 0.0 and found[2] > found[1] > 0.0


def test_waves_lose_more_than_calm_water_of_the_same_mean_speed():
    phase = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
    calm = float(lost(speed=0.36)[0])
    assert float(lost(speed=0.36 + 0.1 * np.sin(phase)).mean()) > calm


def test_a_skirt_that_leans_beyond_the_planing_angle_loses_by_planing():
    upright, planing = (CLOSURES.rates(drivers(lean=lean), OIL)[:, 0] for lean in (0.3, 1.0))
    assert planing[LossCause.PLANING] == pytest.approx(upright.sum())
    assert planing.sum() == pytest.approx(upright.sum())


def test_overflow_has_its_cause_by_the_still_water():
    found = CLOSURES.rates(drivers(speed=0.2, freeboard=-0.03, sunk=np.array([False, True])), OIL)
    assert found[LossCause.SPLASH_OVER, 0] > 0.0 == found[LossCause.SUBMERGENCE, 0]
    assert found[LossCause.SUBMERGENCE, 1] > 0.0 == found[LossCause.SPLASH_OVER, 1]


def test_closures_are_off_where_particles_resolve_the_mechanism():
    fine = replace(CLOSURES, resolution=Resolution(spacing=0.4 / 16, skirt_depth=0.4))
    coarse = replace(CLOSURES, resolution=Resolution(spacing=0.4 / 15, skirt_depth=0.4))
    sharp = replace(CLOSURES, resolution=Resolution(spacing=0.005, skirt_depth=0.4))
    what = drivers(speed=0.7, held=5.0, freeboard=-0.04)
    assert coarse.rates(what, OIL)[LossCause.DRAINAGE] > 0.0
    assert fine.rates(what, OIL)[LossCause.DRAINAGE] == 0.0
    assert (
        fine.rates(what, OIL)[LossCause.ENTRAINMENT] > 0.0 == sharp.rates(what, OIL)[LossCause.ENTRAINMENT]
    )  # of 25 and 5 mm
    assert coarse.rates(what, OIL)[LossCause.SPLASH_OVER] > 0.0 == sharp.rates(what, OIL)[LossCause.SPLASH_OVER]


def test_viscous_oil_is_lost_by_critical_accumulation():
    thick = OilOnWater(oil_density=980.0, water_density=1027.0, kinematic_viscosity=1e-2)
    found = CLOSURES.rates(drivers(speed=0.3), thick)[:, 0]
    assert found[LossCause.CRITICAL_ACCUMULATION] > 0.0 == found[LossCause.ENTRAINMENT]


@pytest.mark.parametrize(
    ("faulty", "text"),
    [
        (lambda: Resolution(spacing=0.1, skirt_depth=0.09), "skirt_depth is 0.09 m, allowed: 0.1 m or more, one spacing"),
        (lambda: Resolution(spacing=0.0, skirt_depth=0.4), "spacing is 0.0, allowed: above 0 m"),
        (lambda: Closures(skirt_depth=-0.4), "closures of a boom: skirt_depth is -0.4, allowed: above 0 m"),
        (lambda: replace(OIL, interfacial_tension=0.0), "interfacial_tension is 0.0, allowed: 0.001 or more and at most 0.1 N/m"),
    ],
)  # fmt: skip
def test_impossible_booms_and_oils_are_refused(faulty: Callable[[], object], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        faulty()
