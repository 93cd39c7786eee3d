"""The closures of a slick without particles: pose and surface of each segment drive them, as they do beside particles."""

from __future__ import annotations

import numpy as np
import pytest

from booms.losses.rates import Closures, PooledBoom, SlickLosses
from oilsim.oil.fates import LossCause
from oilsim.slick.barriers import Boom, Immersion
from oilsim.slick.loss_rate import Pools
from oilsim.slick.oil import Oil
from oilsim.slick.slick import Slick, SlickSettings
from tests.oilsim.slick.flows import UniformFlow

DRAFT, FREEBOARD = 0.4, 0.3  # m
LINE = np.array([[5.0, -15.0], [0.0, -5.0], [0.0, 5.0], [5.0, 15.0]])
LOSSES = SlickLosses([PooledBoom(rows=slice(0, 3), closures=Closures(skirt_depth=DRAFT))])


def losses(immersion: Immersion, speed: float = 0.45) -> np.ndarray:
    """Loss [m3/s] by cause of a boom that has gathered oil in water of a speed [m/s], and sits in the water like this."""
    slick = Slick(
        SlickSettings(loss_volume=10.0, diffusivity=0.0, seed=1), [Boom(name="boom", nodes=LINE, draft=DRAFT)]
    )
    oil = Oil(density=900.0, dynamic_viscosity=0.02, interfacial_tension=0.02)
    slick.release(oil, 2.0, count=200, center=(8.0, 0.0), radius=4.0, age=600.0)
    flow = UniformFlow((-speed, 0.0))
    for step in range(60):
        slick.step(flow, 0.5 * step, 0.5)
    assert slick.oil.contained > 1.0
    slick.move("boom", LINE, immersion)
    slick.step(flow, 30.0, 0.01)
    found = LOSSES(slick.pools)
    return np.array([found.get(cause, np.zeros(1)).sum() for cause in LossCause])


def test_a_top_under_the_local_surface_loses_by_splash_over_and_a_sunk_one_by_submergence() -> None:
    dry = losses(Immersion(DRAFT, freeboard=FREEBOARD))
    topped = losses(Immersion(DRAFT, freeboard=-0.03))
    sunk = losses(Immersion(DRAFT, freeboard=-0.03, is_submerged=True))
    over = [LossCause.SPLASH_OVER, LossCause.SUBMERGENCE]
    assert not dry[over].any()
    assert topped[LossCause.SPLASH_OVER] > 0.0 == topped[LossCause.SUBMERGENCE]
    assert sunk[LossCause.SUBMERGENCE] == pytest.approx(topped[LossCause.SPLASH_OVER])
    assert topped[LossCause.ENTRAINMENT] == pytest.approx(dry[LossCause.ENTRAINMENT])
    assert losses(Immersion(DRAFT)) == pytest.approx(dry)  # an untold top is dry


def test_a_skirt_that_leans_back_loses_more_and_beyond_the_planing_angle_by_planing() -> None:
    lean = np.radians([0.0, 60.0])
    upright, planing = (losses(Immersion(DRAFT * np.cos(angle), lean=angle), speed=0.7) for angle in lean)
    assert planing[LossCause.PLANING] == pytest.approx(planing.sum())
    assert planing.sum() > upright.sum() > 0.0 == upright[LossCause.PLANING]


def gathered(step: float, seconds: float = 120.0) -> tuple[float, float]:
    """Return the oil [m3] that the closures of a U of 24 segments gave, and what went or is owed, in steps [s]."""
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 25)
    line = 15.0 * np.column_stack([1.0 - np.cos(angle), np.sin(angle)])
    slick = Slick(
        SlickSettings(loss_volume=1e-3, diffusivity=0.0, seed=1), [Boom(name="boom", nodes=line, draft=DRAFT)]
    )
    oil = Oil(density=900.0, dynamic_viscosity=0.02, interfacial_tension=0.02)
    slick.release(oil, 2.0, count=500, center=(10.0, 0.0), radius=6.0, age=600.0)
    closures = SlickLosses([PooledBoom(rows=slice(0, 24), closures=Closures(skirt_depth=DRAFT))])
    given = 0.0

    def rate(pools: Pools) -> dict[LossCause, np.ndarray]:
        nonlocal given
        found = dict(closures(pools))
        given += step * sum(float(one.sum()) for one in found.values())
        return found

    for k in range(round(seconds / step)):
        slick.step(UniformFlow((-0.5, 0.0)), step * k, step, rate)
    return given, float(slick.losses.gone.sum() + slick.losses.owed.sum())


def test_a_boom_loses_what_its_closures_give_whatever_the_step() -> None:
    """Parcels slide to and fro over the joints of the apex; a pool that they leave hands its debt on, so that none is forgotten."""
    found = {step: gathered(step) for step in (0.5, 0.2, 0.1)}
    for given, gone in found.values():
        assert gone == pytest.approx(given, rel=0.01)
    assert found[0.1][1] == pytest.approx(found[0.2][1], rel=0.01)


def test_a_swing_shorter_than_the_draft_takes_to_pass_hardly_counts() -> None:
    """A boom swings by 0.3 m/s within 1 s in 0.4 m/s, whose water passes its draft in 1 s: the closures see less than half of the swing."""
    slick = Slick(SlickSettings(loss_volume=10.0, seed=1), [Boom(name="boom", nodes=LINE, draft=DRAFT)])
    seen, met = [], []
    for k in range(600):
        time = 0.02 * k
        swing = 0.3 / (2.0 * np.pi) * np.sin(2.0 * np.pi * np.array([time, time + 0.02]))
        slick.move("boom", LINE + np.array([swing[1], 0.0]))
        slick.step(UniformFlow((-0.4, 0.0)), time, 0.02)
        seen.append(slick.pools.sustained_speed[2:4].max())
        met.append(np.abs(slick.pools.normal_speed[2:4]).max())
    assert np.mean(seen[400:]) == pytest.approx(0.4, rel=0.01)  # a swing to and fro makes no mean speed
    assert np.ptp(seen[400:]) < 0.5 * np.ptp(met[400:])
    assert np.ptp(met[400:]) == pytest.approx(0.6, rel=0.02)
