"""Booms for fast water: a pocket in which the water is slower."""

from __future__ import annotations

import numpy as np
import pytest

from booms.boom import Pocket
from booms.losses.liquids import OilOnWater
from booms.losses.rates import (
    Closures,
    PooledBoom,
    SlickLosses,
)
from oilsim.oil.fates import LossCause
from oilsim.slick.barriers import Boom
from oilsim.slick.oil import Oil
from oilsim.slick.slick import Slick, SlickSettings
from tests.booms.laid import of_the_catalogue
from tests.oilsim.slick.flows import UniformFlow

THICK = OilOnWater(oil_density=950.0, water_density=1025.0, kinematic_viscosity=0.1)  # 95 Pa s, as congealed oil
LINE = np.array([[4.0, -6.0], [0.0, -2.0], [0.0, 2.0], [4.0, 6.0]])


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


def test_what_no_pocket_can_be_is_refused() -> None:
    with pytest.raises(ValueError, match=r"(?s)length is 0.*speed_ratio is 1.*volume is -1"):
        Pocket(length=0.0, speed_ratio=1.0, volume=-1.0)
    with pytest.raises(ValueError, match=r"pocket.length is 4.6 m, allowed: 10 m or more, a segment"):
        of_the_catalogue("current-buster-6", 120.0, 12)
    with pytest.raises(ValueError, match=r"boom 'boom': flow_share is 0., allowed"):
        Boom(name="boom", nodes=LINE, draft=0.8, flow_share=0.0)
