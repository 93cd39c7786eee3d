"""The class `Sea`: shapes, independence of what was asked before and beside, and bad input."""

from __future__ import annotations

import math

import numpy as np
import pytest

from oilsim.sea import (
    CurrentProfile,
    FlowTable,
    JonswapWaves,
    KaimalGusts,
    LangmuirCells,
    RegularWaves,
    Sea,
    SeaDescription,
    SteadyFlow,
    TidalFlow,
    WindDrift,
    WindField,
)  # fmt: skip

POINTS = np.random.default_rng(0).uniform((-50.0, -50.0, -9.0), (50.0, 50.0, 0.5), (600, 3))


def whole_sea(seed=1):
    return SeaDescription(
        depth=10.0,
        waves=JonswapWaves(significant_height=0.5, peak_period=3.0, spread=10.0, seed=seed),
        current=CurrentProfile(flow=TidalFlow(speed=0.6, turn=100.0), shear_exponent=1 / 7),
        wind=WindField(flow=SteadyFlow(speed=8.0, direction=0.3), gusts=KaimalGusts(seed=seed)),
        langmuir=LangmuirCells(seed=seed),
    )


def everything(sea, points, at):
    return [*sea.kinematics(points, at), sea.wind(points, at), sea.surface_drift(points, at)]


def test_results_have_the_shape_of_the_points():
    sea = Sea(whole_sea())
    for shape in ((), (1,), (4, 5), (0,)):
        points = np.zeros((*shape, 3))
        assert sea.elevation(points[..., :2], 1.0).shape == shape
        assert sea.pressure(points, 1.0).shape == shape
        assert sea.velocity(points, 1.0).shape == sea.acceleration(points, 1.0).shape == (*shape, 3)
        assert sea.wind(points, 1.0).shape == sea.surface_drift(points, 1.0).shape == (*shape, 2)


def test_points_do_not_depend_on_their_neighbours():
    sea = Sea(whole_sea())
    together, grid = everything(sea, POINTS, 7.0), everything(sea, POINTS.reshape(20, 30, 3), 7.0)
    alone = [np.concatenate(parts) for parts in zip(*(everything(sea, p[None], 7.0) for p in POINTS[:5]), strict=True)]
    for whole, shaped, part in zip(together, grid, alone, strict=True):
        assert (shaped.reshape(whole.shape) == whole).all()
        assert part == pytest.approx(whole[:5], abs=1e-9)
    assert (sea.elevation(POINTS, 7.0) == together[0]).all()
    assert (sea.velocity(POINTS, 7.0) == together[1]).all()
    assert (sea.acceleration(POINTS, 7.0) == together[2]).all()
    assert (sea.pressure(POINTS, 7.0) == together[3]).all()


def test_points_of_any_layout_are_read_and_left_alone():
    sea, fixed = Sea(whole_sea()), POINTS.copy()
    fixed.flags.writeable = False
    expected = everything(sea, POINTS, 7.0)
    for points in (fixed, np.asfortranarray(POINTS), POINTS.repeat(2, 0)[::2], POINTS.tolist()):
        for value, same in zip(everything(sea, points, 7.0), expected, strict=True):
            assert (value == same).all()
    assert (fixed == POINTS).all()


def test_a_sea_has_no_memory_and_follows_from_its_seeds():
    sea, other = Sea(whole_sea()), Sea(whole_sea())
    everything(other, POINTS, 90.0)
    for value, again in zip(everything(sea, POINTS, 7.0), everything(other, POINTS, 7.0), strict=True):
        assert (value == again).all()
    for value, changed in zip(
        everything(sea, POINTS, 7.0), everything(Sea(whole_sea(seed=2)), POINTS, 7.0), strict=True
    ):
        assert (value != changed).any()


def test_the_level_moves_the_sea():
    low = Sea(whole_sea())
    high = Sea(SeaDescription(**{**vars(whole_sea()), "level": 3.0}))
    for value, moved in zip(
        everything(low, POINTS, 7.0)[1:], everything(high, POINTS + np.array([0, 0, 3.0]), 7.0)[1:], strict=True
    ):
        assert moved == pytest.approx(value, abs=1e-7)
    assert high.elevation(POINTS, 7.0) == pytest.approx(low.elevation(POINTS, 7.0) + 3.0)


def test_a_calm_sea():
    sea = Sea(SeaDescription(depth=5.0))
    motion = sea.kinematics([(0.0, 0.0, -2.0)], 3.0)
    assert (motion.elevation == 0.0).all()
    assert (motion.velocity == 0.0).all()
    assert motion.pressure == pytest.approx(1027.0 * 9.81 * 2.0)
    assert (sea.wind((0.0, 0.0), 0.0) == 0.0).all()
    assert (sea.surface_drift((0.0, 0.0), 0.0) == 0.0).all()


WAVE = {"height": 0.2, "period": 3.0}


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: SeaDescription(depth=0.0), r"sea: depth is 0.0, allowed: above 0 and at most 12000 m"),
        (lambda: SeaDescription(depth=5.0, waves=3), r"sea: waves is a int, allowed: RegularWaves, JonswapWaves, None"),
        (lambda: SeaDescription(depth=-1.0, density=math.nan), r"depth is -1.0.*density is nan"),
        (lambda: SeaDescription(depth=5.0, langmuir=LangmuirCells()), r"langmuir is given without wind and waves"),
        (lambda: RegularWaves(height=-0.2, period=0.0), r"waves: height is -0.2.*period is 0.0"),
        (lambda: RegularWaves(**WAVE, stretching="delta"), r"stretching is 'delta', allowed: wheeler, none"),
        (lambda: RegularWaves(**WAVE, seen_from="air"), r"seen_from is 'air', allowed: water, ground"),
        (lambda: JonswapWaves(significant_height=0.5, peak_period=0.0), r"peak_period is 0.0, allowed: above 0 s"),
        (
            lambda: JonswapWaves(significant_height=0.5, peak_period=3.0, highest_frequency=0.2),
            r"highest_frequency is 0.2 Hz, allowed: above 1 / peak_period = 0.3333 Hz",
        ),
        (
            lambda: JonswapWaves(significant_height=0.5, peak_period=3.0, peakedness=0.5),
            r"peakedness is 0.5, allowed: 1 or more",
        ),
        (
            lambda: JonswapWaves(significant_height=0.5, peak_period=3.0, count=2.5),
            r"count is 2.5, allowed: a whole number",
        ),
        (lambda: CurrentProfile(flow=0.5), r"current: flow is a float, allowed: SteadyFlow, TidalFlow, FlowTable"),
        (
            lambda: CurrentProfile(flow=SteadyFlow(speed=0.5), shear_exponent=-1.0),
            r"shear_exponent is -1.0, allowed: 0 or more",
        ),
        (lambda: SteadyFlow(speed=-1.0), r"speed is -1.0, allowed: 0 or more and at most 100 m/s"),
        (lambda: TidalFlow(speed=1.0, period=0.0), r"period is 0.0, allowed: above 0 s"),
        (
            lambda: WindField(flow=SteadyFlow(speed=0.0), gusts=KaimalGusts()),
            r"flow has the mean 0 m/s, allowed with gusts: above 0",
        ),
        (lambda: KaimalGusts(intensity=0.9), r"intensity is 0.9, allowed: 0 or more and at most 0.5"),
        (
            lambda: KaimalGusts(lowest_frequency=2.0),
            r"lowest_frequency is 2 Hz, allowed: below highest_frequency = 1 Hz",
        ),
        (lambda: WindDrift(layer=0.0), r"layer is 0.0, allowed: above 0"),
        (lambda: LangmuirCells(spacing=0.0), r"spacing is 0.0, allowed: above 0 m"),
        (lambda: SeaDescription(depth=1.0, diffusivity=-1.0), r"diffusivity is -1.0, allowed: 0 or more m2/s"),
    ],
)
def test_impossible_descriptions_are_refused(make, text):
    with pytest.raises(ValueError, match=text):
        make()


@pytest.mark.parametrize(
    ("waves", "depth", "text"),
    [
        (
            {"height": 2.1, "period": 3.0},
            50.0,
            r"height is 2.1 m, allowed: below 1.995 m, where waves of 14.05 m break",
        ),
    ],
)
def test_waves_too_steep_are_refused(waves, depth, text):
    with pytest.raises(ValueError, match=text):
        Sea(SeaDescription(depth=depth, waves=RegularWaves(**waves)))


def test_points_and_times_that_cannot_be_are_refused():
    sea = Sea(whole_sea())
    with pytest.raises(ValueError, match=r"points have the shape \(7, 2\), allowed: \(..., 3\), in m"):
        sea.velocity(np.zeros((7, 2)), 0.0)
    with pytest.raises(ValueError, match=r"points have the shape \(\), allowed: \(..., 2\) or \(..., 3\)"):
        sea.elevation(1.0, 0.0)
    with pytest.raises(ValueError, match=r"point 1 is \(0.0, nan, 0.0\), allowed: finite"):
        sea.pressure([(0.0, 0.0, 0.0), (0.0, math.nan, 0.0)], 0.0)
    with pytest.raises(ValueError, match=r"time is inf, allowed: finite"):
        sea.wind((0.0, 0.0), math.inf)
    table = FlowTable([0.0, 60.0], [(0.1, 0.0), (0.2, 0.0)])
    with pytest.raises(ValueError, match=r"time is 61 s, allowed: 0 to 60 s"):
        Sea(SeaDescription(depth=5.0, current=CurrentProfile(flow=table))).velocity((0.0, 0.0, 0.0), 61.0)


@pytest.mark.parametrize(
    "waves",
    [
        RegularWaves(height=0.5, period=4.0),
        JonswapWaves(significant_height=0.5, peak_period=3.0, spread=10.0, count=100),
    ],
)
def test_each_of_100_000_points_has_what_it_has_alone(waves):
    sea = Sea(SeaDescription(depth=5.0, waves=waves))
    points = np.random.default_rng(0).uniform((-500.0, -500.0, -5.0), (500.0, 500.0, 0.2), (100_000, 3))
    few = [0, 1, 4095, 4096, 50_001, 99_998, 99_999]
    for whole, part in zip(sea.kinematics(points, 7.0), sea.kinematics(points[few], 7.0), strict=True):
        assert np.ptp(whole) > 0.0
        np.testing.assert_allclose(np.asarray(whole)[few], part, rtol=1e-12, atol=1e-12)


def test_heights_on_a_grid_are_those_at_its_crossings():
    sea = Sea(whole_sea())
    x, y = np.linspace(-30.0, 40.0, 700), np.linspace(3.0, 9.0, 60)  # the shortest wave is 16 spacings long
    at_crossings = sea.elevation(np.stack(np.meshgrid(x, y, indexing="ij"), -1), 12.3)
    assert np.abs(sea.grid_elevation(x, y, 12.3) - at_crossings).max() < 1e-12


def test_waves_that_a_grid_cannot_show_are_left_out():
    sea = Sea(SeaDescription(depth=20.0, level=0.5, waves=RegularWaves(height=0.4, period=3.0)))
    length = 2.0 * np.pi / sea.components.wave_number[0]
    still = sea.grid_elevation(np.arange(0.0, 40.0 * length, 0.55 * length), np.zeros(1), 1.0)
    assert (still == 0.5).all()


def test_waves_build_up_and_their_water_speeds_up_with_them():
    """The velocity's rate at a place is the acceleration, build-up included: sin^2(pi t / 2 T) times that of full waves."""
    waves = RegularWaves(height=0.4, period=4.0, stretching="none")
    full, growing = (Sea(SeaDescription(depth=10.0, waves=waves, build_up=time)) for time in (0.0, 8.0))
    points, step = POINTS[:50] * (1.0, 1.0, 0.2) - (0.0, 0.0, 1.0), 1e-4
    assert growing.description.growth(4.0) == pytest.approx((0.5, 0.5 * math.pi / 8.0))
    assert np.array_equal(growing.velocity(points, 8.0), full.velocity(points, 8.0))
    assert np.abs(growing.velocity(points, 0.0)).max() == 0.0
    rate = (growing.velocity(points, 3.0 + step) - growing.velocity(points, 3.0 - step)) / (2.0 * step)
    assert growing.acceleration(points, 3.0) == pytest.approx(rate, abs=1e-6)
    share = growing.description.growth(3.0)[0]
    assert growing.elevation(points[:, :2], 3.0) == pytest.approx(share * full.elevation(points[:, :2], 3.0))
