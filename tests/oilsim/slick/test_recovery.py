"""A skimmer takes the oil that is nearest to it, from parcels and particles alike, and no other."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim.slick.merging import oil_within, recover
from oilsim.slick.parcels import NONE, Parcels, ParcelState

CENTER = (3.0, -2.0)
PLACES = np.array(
    [[3.5, -2.0], [3.0, -1.8], [3.0, -4.0], [-3.0, 2.0], [3.1, -2.0]]
)  # 0.5, 0.2, 2 m from the centre, and its mirror image
VOLUMES = np.array([0.002, 0.001, 0.004, 0.008, 0.016])


def parcels_on_the_water() -> Parcels:
    """Four parcels, of which the second is a particle before a boom, and one ashore beside the centre."""
    parcels = Parcels()
    states = [ParcelState.AFLOAT, ParcelState.RESOLVED, ParcelState.HELD, ParcelState.AFLOAT, ParcelState.STRANDED]
    density = np.array([900.0, 930.0, 950.0, 900.0, 900.0])
    columns = {"position": PLACES, "volume": VOLUMES, "state": states, "density": density}
    rows = parcels.append(columns, 5)
    parcels.place[rows[1]], parcels.particle[rows[1]] = 4, 17
    return parcels


def test_oil_within_a_circle_is_that_on_the_water() -> None:
    volume, density = oil_within(parcels_on_the_water(), CENTER, 1.0)
    assert volume == pytest.approx(0.003)
    assert density == pytest.approx((2.0 * 900.0 + 930.0) / 3.0)
    assert oil_within(parcels_on_the_water(), CENTER, 2.0)[0] == pytest.approx(0.007)  # the circle's line belongs to it
    assert oil_within(parcels_on_the_water(), (30.0, 0.0), 2.0) == (0.0, 0.0)


def test_the_nearest_goes_first_and_the_last_is_split() -> None:
    parcels = parcels_on_the_water()
    assert recover(parcels, CENTER, 2.0, 0.0015) == pytest.approx(0.0015)
    assert parcels.state[1] == ParcelState.RECOVERED  # 0.2 m away
    assert parcels.place[1] == parcels.particle[1] == NONE
    assert parcels.volume[0] == pytest.approx(0.0015)  # half a litre of it has gone
    assert parcels.state[0] == ParcelState.AFLOAT
    assert parcels.volume[parcels.state == ParcelState.RECOVERED].sum() == pytest.approx(0.0015)
    assert parcels.volume.sum() == pytest.approx(VOLUMES.sum(), rel=1e-12)


def test_a_part_of_a_particle_leaves_a_parcel_where_its_boom_holds_it() -> None:
    parcels = parcels_on_the_water()
    assert recover(parcels, CENTER, 2.0, 0.0004) == pytest.approx(0.0004)
    assert parcels.state[1] == ParcelState.HELD
    assert (parcels.place[1], parcels.particle[1]) == (4, NONE)
    assert parcels.volume[1] == pytest.approx(0.0006)


def test_a_parcel_of_just_the_volume_goes_whole_and_no_more_than_there_is() -> None:
    parcels = parcels_on_the_water()
    assert recover(parcels, CENTER, 1.0, 0.001) == pytest.approx(0.001)
    assert len(parcels) == 5
    assert recover(parcels, CENTER, 1.0, 100.0) == pytest.approx(0.002)
    assert recover(parcels, CENTER, 1.0, 100.0) == 0.0


def test_all_recovered_oil_is_one_parcel_with_the_mean_properties() -> None:
    parcels = parcels_on_the_water()
    mass = (parcels.volume * parcels.density).sum()
    for _ in range(3):
        recover(parcels, CENTER, 1.0, 0.0009)
    gone = parcels.state == ParcelState.RECOVERED
    assert gone.sum() == 1
    assert parcels.volume[gone] == pytest.approx(0.0027)
    assert parcels.density[gone] == pytest.approx((930.0 + 1.7 * 900.0) / 2.7)
    assert (parcels.volume * parcels.density).sum() == pytest.approx(mass, rel=1e-12)


def test_recovered_oil_of_each_kind_is_a_parcel() -> None:
    parcels = parcels_on_the_water()
    parcels.oil[2] = 1
    assert recover(parcels, CENTER, 1e3, 1.0) == pytest.approx(0.015)
    gone = parcels.state == ParcelState.RECOVERED
    found = dict(zip(parcels.oil[gone].tolist(), parcels.volume[gone].tolist(), strict=True))
    assert found == pytest.approx({0: 0.011, 1: 0.004})
    assert gone.sum() == 2


@pytest.mark.parametrize(
    ("radius", "volume", "name"), [(-1.0, 1.0, "radius"), (1.0, np.nan, "volume"), (np.inf, 1.0, "radius")]
)
def test_unsound_radii_and_volumes_are_refused(radius: float, volume: float, name: str) -> None:
    with pytest.raises(ValueError, match=f"recovery: {name} is"):
        recover(parcels_on_the_water(), CENTER, radius, volume)
    assert recover(parcels_on_the_water(), CENTER, 0.0, 0.0) == 0.0
