"""Oil crosses a window both ways: as particles where it is thick, as parcels elsewhere, and none is made or lost on the way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from oilsim.oil.fates import LossCause
from oilsim.sea import CurrentProfile, RegularWaves, SteadyFlow
from oilsim.slick.barriers import Boom
from oilsim.slick.parcels import ParcelState
from oilsim.window.oil_exchange import BESIDE, OilExchange, follow_particles
from oilsim.window.window import Window
from tests.oilsim.window.meeting import CRUDE, CURRENT, OIL, PARTICLE, SPACING, WATER, Meeting


def test_thick_oil_becomes_particles_and_leaves_as_parcels(meet: Callable[..., Meeting]) -> None:
    """Poured in the middle, it is particles; all leave through the rim as parcels, and none stays behind there."""
    current = CurrentProfile(flow=SteadyFlow(speed=CURRENT))
    case = meet(current=current, waves=RegularWaves(height=0.1, period=2.5))
    case.slick.release(OIL, 0.6, count=200, center=(-0.5, 0.0), radius=0.5)
    most, seen = 0, []
    for _ in range(38):
        case.step()
        case.require_exact()
        most = max(most, case.oil_particles)
        oil = case.window.fluid.phase_positions("crude")
        if len(oil):
            seen.append(case.window.rim.inward(oil).min())
    assert most > 0.4 * 0.6 / PARTICLE
    assert min(seen) >= case.window.rim.width - 1e-6
    assert case.oil_particles == 0
    assert case.exchange.taken == pytest.approx(case.exchange.given)


def test_a_slick_thinner_than_a_particle_stays_parcels_and_is_carried_along(meet: Callable[..., Meeting]) -> None:
    case = meet()
    case.slick.release(OIL, 0.001, count=50, center=(0.0, 0.0), radius=0.5)
    before = case.slick.parcels.position.copy()
    at = case.window.fluid.particles.position
    swirl = np.zeros((3, case.window.fluid.particle_count))
    swirl[0] = 0.2 * np.exp(-(at[0] ** 2 + at[1] ** 2))
    case.window.fluid.set_velocities(swirl)
    for _ in range(5):
        case.step()
    case.require_exact()
    assert case.exchange.taken == 0.0
    moved = (case.slick.parcels.position - before).mean(0)
    assert 0.02 < moved[0] < 0.1
    assert abs(moved[1]) < 0.01


@pytest.mark.parametrize(("spacings", "becomes"), [(0.55, False), (0.95, False), (1.0, True), (1.5, True)])
def test_oil_becomes_particles_where_it_is_as_thick_as_a_particle_is_wide(
    meet: Callable[..., Meeting], spacings: float, becomes: bool
) -> None:
    case = meet()
    case.slick.release(OIL, 0.6, count=200, center=(0.0, 0.0), radius=0.5)
    case.slick.parcels.thickness[:] = spacings * SPACING
    case.exchange.exchange(case.slick, case.time)
    assert (case.oil_particles > 0) == becomes
    case.require_exact()


NODES = [[-2.0, -1.4], [0.0, -1.4], [0.0, 0.0], [0.0, 1.4], [-2.0, 1.4]]
STREAM = CurrentProfile(flow=SteadyFlow(speed=CURRENT))


def test_a_boom_thickens_oil_into_particles_that_pass_it(meet: Callable[..., Meeting]) -> None:
    """The line holds parcels until they are as thick as a particle; the particles know no skirt here, pass, and are booked as lost."""
    case = meet((Boom(name="pocket", nodes=NODES, draft=0.6),), current=STREAM)
    case.slick.release(OIL, 1.2, count=400, center=(-1.9, 0.0), radius=1.0, age=5.0)
    for _ in range(25):
        case.step()
        case.require_exact()
        oil = case.slick.oil
        assert oil.contained == pytest.approx(case.slick.pools.volume.sum()), (
            "what has just become particles is held, too"
        )
    assert case.exchange.taken > 0.1
    passed = sum(case.slick.losses.passed[cause] for cause in ("drainage", "through", "splash_over"))
    assert passed > 0.05
    assert oil.all_lost > 0.0


def test_particles_that_pass_where_a_boom_has_parted_are_lost_through_the_joint(meet: Callable[..., Meeting]) -> None:
    case = meet((Boom(name="pocket", nodes=NODES, draft=0.6),), current=STREAM)
    case.slick.part("pocket", 2)
    case.slick.move("pocket", [*NODES[:2], [0.0, -1.2], [0.0, 1.2], *NODES[3:]])
    case.slick.barriers.settle()
    case.slick.release(OIL, 0.6, count=200, center=(-1.2, 0.0), radius=0.4)
    for _ in range(25):
        case.step()
        case.require_exact()
    through = LossCause.THROUGH
    carried = case.slick.losses.carried[through].sum()
    assert 0.1 < carried <= case.slick.losses.gone[through].sum() <= 0.6


def test_particles_before_a_boom_stay_held_while_a_wave_carries_the_water_back(meet: Callable[..., Meeting]) -> None:
    """Until it has run back by three drafts; what the boom holds is the same in the account and in its pools."""
    case = meet((Boom(name="pocket", nodes=NODES, draft=0.6),), current=STREAM)
    case.slick.release(OIL, 0.6, count=200, center=(-0.6, 0.0), radius=0.4)
    for _ in range(8):
        case.step()
    parcels = case.slick.parcels
    rows = np.flatnonzero((parcels.state == ParcelState.RESOLVED) & (parcels.place >= 0))
    assert len(rows) > 3
    at, height = parcels.position[rows], np.zeros(len(rows))
    back = np.tile([-0.3, 0.0], (len(case.slick.barriers), 1))  # while the stream runs to +x
    follow_particles(case.slick, rows, at, height, back)
    assert (parcels.place[rows] >= 0).all()
    case.slick.slack[:] = 1.0
    follow_particles(case.slick, rows, at, height, back)
    assert (parcels.place[rows] < 0).all()


def test_a_restored_exchange_repeats_its_steps(meet: Callable[..., Meeting]) -> None:
    case = meet(current=CurrentProfile(flow=SteadyFlow(speed=CURRENT)))
    case.slick.release(OIL, 0.4, count=100, center=(-0.5, 0.0), radius=0.5)
    for _ in range(8):
        case.step()
    assert case.oil_particles
    fluid, slick, time = case.window.fluid.save_state(), case.participant.save_state(), case.time
    ends = []
    for _ in range(2):
        for _ in range(5):
            case.step()
        ends.append((case.slick.parcels.save_state(), case.window.fluid.particles.position.copy(), case.exchange.given))
        case.window.fluid.restore_state(fluid)
        case.participant.restore_state(slick)
        case.time = time
    for name, values in ends[0][0].items():
        np.testing.assert_array_equal(values, ends[1][0][name], err_msg=name)
    np.testing.assert_array_equal(ends[0][1], ends[1][1])
    assert ends[0][2] == ends[1][2]


def test_held_oil_joins_particles_beside_it_and_no_others(meet: Callable[..., Meeting]) -> None:
    """Parcels are held in a row, all thinner than a particle; those within reach of a particle that is not lost become particles."""
    case = meet((Boom(name="pocket", nodes=NODES, draft=0.6),))
    oil, parcels = case.slick, case.slick.parcels
    oil.release(OIL, 2.0 * PARTICLE, count=2, center=(-0.3, 0.0), radius=0.01)
    parcels.thickness[:] = 1.0
    case.exchange.exchange(oil, 0.0)
    assert case.oil_particles == 2
    parcels.position[:], parcels.cause[1] = [[-0.3, -0.5], [-0.3, 0.9]], LossCause.DRAINAGE
    row = np.linspace(-1.2, 1.2, 250)
    oil.release(OIL, 250.0 * PARTICLE, count=250, center=(-0.3, 0.0), radius=0.01)
    held = np.flatnonzero(parcels.state == ParcelState.AFLOAT)
    parcels.position[held] = np.column_stack([np.full(250, -0.3), row])
    parcels.state[held], parcels.place[held], parcels.side[held] = ParcelState.HELD, 1, -1
    parcels.thickness[held] = 0.01
    before = case.exchange.taken
    case.exchange.exchange(oil, 0.0)
    left = parcels.position[parcels.state == ParcelState.HELD, 1]
    beyond = np.abs(row + 0.5) >= BESIDE * SPACING
    assert beyond.sum() == 136
    assert set(row[beyond]) <= set(left)
    assert case.exchange.taken > before


def test_each_oil_becomes_particles_of_its_own(meet: Callable[..., Meeting]) -> None:
    """Two oils of the same density, beside brine: the number of the oil tells its liquid, not the density, nor another liquid's place."""
    case = meet()
    fuel, brine = replace(CRUDE, name="fuel", dynamic_viscosity=1.0), replace(WATER, name="brine", rest_density=1040.0)
    window = Window(case.window.settings, case.window.motion.sea, (WATER, brine, CRUDE, fuel), threads=1)
    try:
        exchange = OilExchange(window, oils=["crude", "fuel"])
        case.slick.release(replace(OIL, number=1), 0.4, count=100, center=(0.5, 0.0), radius=0.4)
        case.slick.release(OIL, 0.2, count=100, center=(-0.8, 0.0), radius=0.3)
        exchange.exchange(case.slick, 0.0)
        parcels = case.slick.parcels
        for number, name in enumerate(("crude", "fuel")):
            own = (parcels.state == ParcelState.RESOLVED) & (parcels.oil == number)
            assert set(parcels.particle[own].tolist()) == set(window.fluid.phase_ids(name).tolist())
            assert own.sum() > 5
    finally:
        window.fluid.close()


def test_a_window_without_oil_is_refused(meet: Callable[..., Meeting]) -> None:
    case = meet()
    water = Window(case.window.settings, case.window.motion.sea, (WATER,), threads=1)
    try:
        with pytest.raises(ValueError, match="allowed: water and an oil or more"):
            OilExchange(water)
    finally:
        water.fluid.close()


def test_oil_that_splashes_out_of_the_window_is_a_parcel_again(meet: Callable[..., Meeting]) -> None:
    case = meet()
    case.slick.release(OIL, 0.6, count=200, center=(0.0, 0.0), radius=0.5)
    for _ in range(3):
        case.step()
    fluid = case.window.fluid
    fluid.advance(1e-3)
    splash = np.flatnonzero(fluid.state.phase)[0]
    fluid.state.position[:, splash] = (2.3, 0.0, fluid.config.upper[2] + 0.1)
    case.exchange.exchange(case.slick, case.time)
    assert case.oil_particles == case.in_state(ParcelState.RESOLVED) > 0
    assert fluid.particle_count == 24 * 24 * 4 - 1
    assert abs(case.slick.oil.residual) < 1e-12
