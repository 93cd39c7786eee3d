"""The oil of a boom whose oil is a slick: what particles of a window carry past is resolved, the rest is modelled."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from coupling.master.co_simulation import CoSimulation
from coupling.participants.slick import SlickParticipant
from oilsim.oil.fates import CAUSES, LossCause
from oilsim.sea import RegularWaves, Sea, SeaDescription, Tide
from oilsim.slick.parcels import ParcelState
from scenarios.running.assembly import Assembly, build
from scenarios.spec.load import load_scenario
from scenarios.watch.boom_score import Oil
from scenarios.watch.slick_oil import phase_of, volume_within
from tests.seas import steady_sea


@contextmanager
def begun(name: str) -> Iterator[tuple[Assembly, CoSimulation, SlickParticipant]]:
    """Begin a shipped exercise, and end it after the block."""
    assembly = build(load_scenario(name).scenario)
    simulation = assembly.co_simulation()
    simulation.initialize()
    try:
        yield assembly, simulation, assembly.slicks[0]
    finally:
        simulation.terminate()


def test_what_particles_carry_past_is_resolved() -> None:
    with begun("sweep-200m") as (assembly, simulation, slick):
        simulation.step()
        losses, first = slick.slick.losses, slick.slick.barriers.rows("main").start
        losses.gone[LossCause.DRAINAGE, first], losses.carried[LossCause.DRAINAGE, first] = 3.0, 1.0
        losses.gone[LossCause.ENTRAINMENT, first + 1] = 0.5
        slick.restore_state(slick.save_state())
        simulation.step()
        (boom,) = assembly.scoring.booms
        none = dict.fromkeys(CAUSES, 0.0)
        assert boom.oil.lost == pytest.approx(none | {"drainage": 3.0, "entrainment": 0.5})
        assert boom.oil.lost_modelled == pytest.approx(none | {"drainage": 2.0, "entrainment": 0.5})


def test_in_a_tide_the_stream_of_the_moment_runs_against_the_boom() -> None:
    """Speeds of a moored boom are those of its sea, which turns; with a steady current alone they were known before."""
    with begun("harbour-1km") as (assembly, simulation, _):
        simulation.step()
        assert assembly.world is not None
        sea: Any = assembly.world.environment
        stream = sea.sea.current([assembly.level], simulation.communication_point.time)[0]
        series = next(iter(assembly.scoring.booms)).series()
        assert np.hypot(*stream) > 0.1
        assert [series["metrics/current/x"], series["metrics/current/y"]] == pytest.approx(stream.tolist())
        wind = [assembly.scoring.series()[f"metrics/wind/{axis}"] for axis in "xy"]
        assert np.hypot(*wind) == pytest.approx(6.0)


def test_oil_that_is_skimmed_or_floats_off_stays_among_what_the_boom_has_met() -> None:
    """So a small loss does not become a large share of what is left; the half that is taken is not lost either."""
    with begun("j-sweep-skimmer") as (assembly, simulation, slick):
        simulation.step()
        oil, (boom,) = slick.slick, assembly.scoring.booms
        rows = oil.barriers.rows("main")
        oil.parcels.state[:], oil.parcels.place[:], oil.parcels.side[:] = ParcelState.HELD, rows.start + 3, 1
        simulation.step()
        held = boom.oil.contained
        assert held > 0.0
        (skimmer,) = assembly.skimmers
        taken = 0.5 * held
        oil.recover(tuple(oil.parcels.position[0]), 1e3, taken)
        skimmer.skimmer.account.oil += taken
        oil.losses.gone[LossCause.DRAINAGE, rows.start] = 0.004 * held
        slick.restore_state(slick.save_state())
        simulation.step()
        assert boom.oil.contained <= held - taken
        assert boom.oil.met == pytest.approx(held, rel=0.01)
        assert boom.oil.contained_share == pytest.approx(1.0 - boom.oil.all_lost / held, rel=0.01)
        assert assembly.scoring.ledger.rows.recovered == pytest.approx(boom.oil.recovered) == pytest.approx(taken)


def test_particles_of_a_window_are_not_counted_beside_the_parcels_that_they_are() -> None:
    """Their places are those in the window's box at rest: one that goes out of and into the boom there has not been taken back."""
    with begun("sweep-200m") as (assembly, simulation, slick):
        simulation.step()
        (boom,) = assembly.scoring.booms
        assert assembly.world is not None
        barriers = slick.slick.barriers
        within = np.array([[*barriers.start[barriers.rows("main")].mean(axis=0), 0.0]])
        for second, place in enumerate((within, within - [500.0, 0.0, 0.0], within)):
            particle = place, np.zeros(1, np.uint32)
            boom.advance(1.0 + second, assembly.world, Oil(*particle, slicks=(slick,)), 0.0, np.zeros(3))
        assert boom.summary()["recontained_m3"] == 0.0
        assert not len(boom.containment.standing().ids)


def test_what_a_skimmer_has_taken_is_neither_shown_nor_in_the_protected_area() -> None:
    """Half of the oil is taken where it lies; the other half is all that pictures, maps and the area's score still have."""
    with begun("j-sweep-skimmer") as (_, _, slick):
        oil, parcels = slick.slick, slick.slick.parcels
        whole, (x, y) = float(parcels.volume.sum()), parcels.position.mean(axis=0)
        everywhere = np.array([[-1e3, -1e3], [1e3, -1e3], [1e3, 1e3], [-1e3, 1e3]])
        assert volume_within(slick, everywhere) == pytest.approx(whole)
        before = set(phase_of(slick, 0, steady_sea(), 0.0).id.tolist())
        taken = oil.recover((float(x), float(y)), 1e3, 0.5 * whole)
        assert taken == pytest.approx(0.5 * whole)
        shown = phase_of(slick, 0, steady_sea(), 0.0)
        assert volume_within(slick, everywhere) == pytest.approx(0.5 * whole)
        assert len(shown.position) == int(parcels.there().sum()) < len(before)
        assert np.linalg.norm(shown.position[:, :2] - [x, y], axis=1).min() > 0.5  # the nearest went first
        oil.recover((float(x), float(y)), 1e3, whole)
        assert volume_within(slick, everywhere) == 0.0
        assert len(phase_of(slick, 0, steady_sea(), 0.0).id) == 0


def test_oil_floats_on_tide_and_waves() -> None:
    """At low water, -2 m, in waves: each parcel is recorded at the height of the surface where it is."""
    sea = Sea(
        SeaDescription(
            depth=10.0, waves=RegularWaves(height=0.5, period=4.0), tide=Tide(turns=((0.0, 1.0), (200.0, -1.0)))
        )
    )
    with begun("j-sweep-skimmer") as (_, _, slick):
        shown = phase_of(slick, 0, sea, 200.0)
        height = sea.elevation(shown.position[:, :2].astype(float), 200.0)
        assert -2.3 < height.min() < -2.1 < -1.9 < height.max() < -1.7
        assert shown.position[:, 2] == pytest.approx(height, abs=1e-4)
