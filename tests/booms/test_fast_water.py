"""Booms for fast water: the drag of a net, oil that seeps through it, and a pocket in which the water is slower."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from booms.boom import BoomDesign
from booms.catalog import catalogue
from booms.fast_water import Net, Pocket
from booms.loads import segment_loads, skirt_drag
from booms.losses.drainage import drainage_rate, held_thickness
from booms.losses.liquids import OilOnWater
from booms.losses.rates import (
    Closures,
    Drivers,
    PooledBoom,
    SlickLosses,
    accumulation_rate,
    seepage_rate,
    seepage_speed,
)
from booms.losses.slick import boom_thickness
from booms.segments import boom_segment
from oilsim.loads.morison import FloatingBodies
from oilsim.slick.barriers import Boom
from oilsim.slick.loss_cause import LossCause
from oilsim.slick.oil import Oil
from oilsim.slick.slick import Slick, SlickSettings
from oilsim.slick.surface_flow import UniformFlow
from tests.seas import steady_sea

NET = Net(solidity=0.3, mesh_opening=0.008)
THICK = OilOnWater(oil_density=950.0, water_density=1025.0, kinematic_viscosity=0.1)  # 95 Pa s, as congealed oil
LINE = np.array([[4.0, -6.0], [0.0, -2.0], [0.0, 2.0], [4.0, 6.0]])


def test_a_net_has_the_drag_and_the_wake_of_loelands_screen() -> None:
    assert NET.drag_coefficient == pytest.approx(0.3 - 0.1116 + 0.3699)
    assert NET.through_share == pytest.approx(1.0 - 0.46 * 0.5583)
    assert (NET.mesh_opening / NET.mesh_pitch) ** 2 == pytest.approx(0.7)  # open part of the area


def test_water_drags_the_float_as_a_wall_and_the_net_as_a_screen() -> None:
    design = BoomDesign(
        length=60.0, segment_count=20, skirt_depth=0.6, freeboard=0.3, buoyancy_to_weight=6.0, skirt_thickness=0.005
    )
    boom = replace(design, net=NET).boom()
    segment = boom_segment(boom)
    model, pose = segment_loads(segment, boom), np.zeros((1, 7))
    pose[0, 2], pose[0, 6] = -segment.waterline, 1.0
    sea = steady_sea(density=1027.0, current=(0.0, 0.6))
    force = FloatingBodies([model], sea).loads(0.0, pose, np.zeros((1, 6))).wrench[0, 1]
    area = skirt_drag(boom.water_density) * boom.float_draft + NET.drag_coefficient * (0.6 - boom.float_draft)
    assert force == pytest.approx(0.5 * 1027.0 * 0.6**2 * 3.0 * area, rel=1e-6)
    # the water that a wall of the float's draft takes along, not one of the net's
    assert model.parts[0].added_mass[1] == pytest.approx(1025.0 * np.pi / 2.0 * boom.float_draft**2 * 3.0, rel=0.01)


def test_thick_oil_seeps_as_through_holes_and_thin_oil_passes_with_the_water() -> None:
    h = np.array([0.0, 0.1, 0.2])
    pressure = 0.5 * 950.0 * 9.81 * (75.0 / 1025.0) * h
    expected = 0.004**3 * pressure / (3.0 * 95.0) / (0.008**2 / 0.7)  # Q = r^3 Dp / (3 mu) for every mesh
    assert seepage_speed(0.5, h, NET, THICK) == pytest.approx(expected, rel=1e-3)
    assert seepage_rate(0.5, h, NET, THICK) == pytest.approx(h * expected, rel=1e-3)
    for viscosity in (1e-5, 0.0):
        thin = replace(THICK, kinematic_viscosity=viscosity)
        assert seepage_speed(0.5, h, NET, thin) == pytest.approx([0.0, *[0.5 * NET.through_share] * 2])


def test_only_the_water_that_goes_under_a_net_takes_oil_along() -> None:
    speed, held = np.array([0.8]), np.array([1.0])
    drivers = Drivers(
        speed=speed,
        draft=np.array([0.6]),
        held=held,
        lean=np.zeros(1),
        freeboard=np.full(1, 0.3),
        sunk=np.zeros(1, bool),
    )
    skirt, net = (Closures(skirt_depth=0.6, net=net).rates(drivers, THICK)[:, 0] for net in (None, NET))
    thickness, below = boom_thickness(speed, held, THICK), (1.0 - NET.through_share) * speed
    share = skirt[LossCause.CRITICAL_ACCUMULATION] / accumulation_rate(speed, thickness, THICK)
    assert net[LossCause.CRITICAL_ACCUMULATION] == pytest.approx(share * accumulation_rate(below, thickness, THICK))
    drained = drainage_rate(below, thickness, held_thickness(below, np.array([0.6]), THICK), 0.6, THICK)
    assert net[LossCause.DRAINAGE] == pytest.approx(share * drained)
    assert net[LossCause.THROUGH] == pytest.approx(seepage_rate(speed, thickness, NET, THICK))
    assert skirt[LossCause.THROUGH] == 0.0
    assert net.sum() < 0.1 * skirt.sum()  # at 1.5 kn congealed oil stays in a net, and passes a skirt


@pytest.mark.parametrize(("count", "inside"), [(20, [9, 10]), (21, [9, 10, 11]), (5, [2])])
def test_a_pocket_is_the_middle_of_its_boom(count: int, inside: list[int]) -> None:
    shares = Pocket(length=6.1, speed_ratio=0.2, volume=1.0).flow_shares(60.0, count)
    assert np.flatnonzero(shares == 0.2).tolist() == inside
    assert set(shares) == {0.2, 1.0}


def swept(pocket: Pocket, volume: float, speed: float = 1.5) -> tuple[Slick, np.ndarray]:
    """A boom of three segments with a pocket in the middle, in a fast stream with some oil [m3]; and its loss rates by cause and pool."""
    boom = Boom(name="boom", nodes=LINE, draft=0.8, flow_share=[1.0, pocket.speed_ratio, 1.0])
    slick = Slick(SlickSettings(loss_volume=100.0, diffusivity=0.0, seed=1), [boom])
    oil = Oil(density=900.0, dynamic_viscosity=0.02, interfacial_tension=0.02)
    slick.release(oil, volume, count=200, center=(5.0, 0.0), radius=1.5, age=60.0)
    flow = UniformFlow((-speed, 0.0))
    for step in range(40):
        slick.step(flow, 0.2 * step, 0.2)
    own = PooledBoom(rows=slice(0, 3), closures=Closures(skirt_depth=0.8), pocket=pocket, pocket_rows=slice(1, 2))
    found = SlickLosses([own])(slick.pools)
    return slick, np.array([found.get(cause, np.zeros(6)) for cause in LossCause])


def test_a_pocket_holds_what_a_skirt_loses_at_three_knots() -> None:
    slick, rates = swept(Pocket(length=4.0, speed_ratio=0.2, volume=5.0), 2.0)
    assert slick.pools.normal_speed[2:4] == pytest.approx([-0.3, 0.3])
    assert slick.pools.volume[3] > 1.8
    assert not rates[:, 3].any()
    open_water, torn = swept(Pocket(length=4.0, speed_ratio=0.999, volume=5.0), 2.0)
    assert torn[:, 3].sum() > 0.01 * open_water.pools.volume[3]


def test_an_overfull_pocket_lets_the_rest_out_as_fast_as_the_water_passes() -> None:
    slick, rates = swept(Pocket(length=4.0, speed_ratio=0.2, volume=1.0), 2.0)
    assert rates[LossCause.DRAINAGE, 3] == pytest.approx((slick.pools.volume[3] - 1.0) * 0.3 / 4.0)
    assert Pocket(length=4.0, speed_ratio=0.2, volume=1.0).overflow(0.9, 0.3) == 0.0


def test_what_no_net_and_no_pocket_can_be_is_refused() -> None:
    with pytest.raises(ValueError, match=r"(?s)solidity is 0.5.*mesh_opening is 0"):
        Net(solidity=0.5, mesh_opening=0.0)
    with pytest.raises(ValueError, match=r"(?s)length is 0.*speed_ratio is 1.*volume is -1"):
        Pocket(length=0.0, speed_ratio=1.0, volume=-1.0)
    with pytest.raises(ValueError, match=r"pocket.length is 4.6 m, allowed: 10 m or more, a segment"):
        catalogue()["current-buster-6"].boom(120.0, 12)
    with pytest.raises(ValueError, match=r"boom 'boom': flow_share is 0., allowed"):
        Boom(name="boom", nodes=LINE, draft=0.8, flow_share=0.0)
