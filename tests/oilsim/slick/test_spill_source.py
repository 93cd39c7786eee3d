"""Oil that runs out pours its volume at its rate, to the last litre, and goes on after a restart as before."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim.slick.barriers import Outline
from oilsim.slick.oil import Oil
from oilsim.slick.slick import Slick, SlickSettings
from oilsim.slick.spill_source import SpillSource

OIL = Oil(density=880.0, dynamic_viscosity=0.02, interfacial_tension=0.02)
SHORE = [(20.0, -50.0), (60.0, -50.0), (60.0, 50.0), (20.0, 50.0)]


def poured(source: SpillSource, slick: Slick, begin: float, end: float, step: float = 0.1) -> None:
    for index in range(round((end - begin) / step)):
        source.pour(slick, begin + index * step, step)


@pytest.mark.parametrize(("volume", "until", "expected"), [(None, 12.05, 0.02 * 9.0), (0.1, 30.0, 0.1)])
def test_volume_is_rate_times_time_until_it_is_empty(volume, until, expected):
    """0.02 m3/s from 3.05 s on: a second of flow a parcel; nothing is rounded away."""
    slick = Slick(SlickSettings(loss_volume=0.001))
    source = SpillSource("leak", OIL, (1.0, 2.0), 0.1, 0.02, start=3.05, volume=volume)
    poured(source, slick, 0.0, until, step=0.05)
    assert slick.oil.spilled + source.save_state()["owed"] == pytest.approx(expected, rel=1e-12)
    assert len(slick.parcels) in (expected // 0.02, expected // 0.02 + 1)
    assert np.abs(slick.parcels.position - (1.0, 2.0)).max() < 3.0


def test_rate_may_change_and_a_restart_goes_on():
    ends = []
    for halts in (False, True):
        slick, source = Slick(SlickSettings(loss_volume=0.001)), SpillSource("leak", OIL, (0.0, 0.0), 0.1, 0.0)
        poured(source, slick, 0.0, 2.0)
        source.rate = 0.01
        poured(source, slick, 2.0, 4.5)
        if halts:
            saved, source = source.save_state(), SpillSource("leak", OIL, (0.0, 0.0), 0.1, 0.0)
            source.restore_state(saved)
        poured(source, slick, 4.5, 9.0)
        ends.append(slick.parcels.volume.copy())
    assert ends[0].sum() == pytest.approx(0.01 * 7.0, abs=0.01)
    assert np.array_equal(*ends)


@pytest.mark.parametrize("shore", [SHORE, SHORE[::-1]])
@pytest.mark.parametrize(
    ("where", "nearest"), [((26.0, 5.0), (20.0, 5.0)), ((20.01, 5.0), (20.0, 5.0)), ((30.0, 48.0), (30.0, 50.0))]
)
def test_oil_poured_on_land_runs_down_to_the_nearest_water(shore, where, nearest):
    """Whichever way round the outline is given, and whether the disc lies in it as a whole or in part."""
    slick = Slick(SlickSettings(loss_volume=0.001, seed=2), [Outline(name="shore", nodes=shore, capacity=1.0)])
    poured(SpillSource("leak", OIL, where, 0.1, 0.0001), slick, 0.0, 9.0)
    assert slick.oil.spilled == pytest.approx(0.0009)
    assert not slick.barriers.encloses(slick.parcels.position).any()
    assert np.abs(slick.parcels.position - nearest).max() < 0.1
    with pytest.raises(ValueError, match="reaches into an outline, allowed: water"):
        slick.release(OIL, 0.1, count=10, center=where, radius=0.1)


@pytest.mark.parametrize(
    ("change", "words"), [({"rate": -1.0}, "rate"), ({"volume": 0.0}, "volume"), ({"radius": 0.0}, "radius")]
)
def test_impossible_sources_are_refused(change, words):
    with pytest.raises(ValueError, match=words):
        SpillSource("leak", OIL, (0.0, 0.0), **({"radius": 0.1, "rate": 0.1} | change))
