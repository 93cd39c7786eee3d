"""A shore: booms laid over its waterline, tubes that seal there, a waterline that follows the tide, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from booms.boom import catalogue
from booms.losses.rates import Closures, PooledBoom, SlickLosses
from coupling.participants.plan_barriers import Beach
from oilsim.slick.barriers import Boom, Immersion, Outline
from oilsim.slick.oil import Oil
from oilsim.slick.slick import Slick, SlickSettings
from scenarios.running.assembly import build
from scenarios.setup.layout import lay_out
from scenarios.spec.load import load_scenario
from scenarios.spec.resolve import resolve
from scenarios.text.problems import ScenarioError
from tests.booms.laid import of_the_catalogue
from tests.oilsim.slick.flows import UniformFlow

BEACH = Beach(waterline=(0.0, 0.0, 0.0), seaward=-0.5 * math.pi, slope=0.05, width=100.0, capacity=0.001)


def test_the_ground_falls_away_seaward_and_the_waterline_follows_the_tide() -> None:
    places = np.array([[0.0, 0.0], [7.0, -20.0], [-3.0, 10.0]])
    assert BEACH.height(places) == pytest.approx([0.0, -1.0, 0.5])
    assert np.linalg.norm(BEACH.normal) == pytest.approx(1.0)
    assert np.array(BEACH.normal) @ (1.0, -20.0, -1.0) == pytest.approx(
        np.array(BEACH.normal) @ (1.0, 0.0, 0.0), abs=1e-12
    )
    edge = BEACH.outline(-0.3)[:-2]
    assert edge[:, 1] == pytest.approx(np.full(21, -6.0))  # 0.3 m of water less, on a slope of 1 in 20
    assert np.ptp(edge[:, 0]) == pytest.approx(100.0)


def test_a_boom_over_the_waterline_lies_on_the_ground_and_floats_beyond() -> None:
    fleet = lay_out(resolve(load_scenario("shore-seal").scenario)).fleet
    layout = fleet.booms["main"]
    lowest, ground = [], []
    for segment in layout.segments:
        turn = Rotation.from_quat(segment.orientation)
        foot = segment.position + turn.apply([0.0, 0.0, layout.segment.waterline - layout.boom.skirt_depth])
        lowest.append(foot[2])
        ground.append(float(BEACH.height(foot[None, :2])[0]))
    gap = np.array(lowest) - ground
    assert gap[:6] == pytest.approx(np.zeros(6), abs=0.01)
    assert (gap >= -0.01).all() and (gap[8:] > 0.05).all()
    assert np.array(lowest[8:]) == pytest.approx(np.full(17, -0.3), abs=1e-9)  # afloat at its waterline


@pytest.mark.parametrize("boom", ["shore-seal", pytest.param("cfr-rivers", marks=pytest.mark.slow)])
def test_tubes_seal_where_they_lie_and_a_plain_skirt_does_not(boom: str) -> None:
    assembly = build(load_scenario("shore-seal", overrides=[f"booms.main.boom={boom}"]).scenario)
    simulation = assembly.co_simulation()
    simulation.initialize()
    simulation.step()
    found = assembly.slicks[0].slick.barriers.is_sealed[:25]
    simulation.terminate()
    assert np.flatnonzero(found).tolist() == (list(range(7)) if boom == "shore-seal" else [])


def test_nothing_passes_under_a_foot_that_is_sealed() -> None:
    line = np.array([[0.0, -10.0], [0.0, 0.0], [0.0, 10.0]])
    closures = SlickLosses([PooledBoom(rows=slice(0, 2), closures=Closures(skirt_depth=0.3))])
    slick = Slick(SlickSettings(loss_volume=1.0, seed=1), [Boom(name="boom", nodes=line, draft=0.3)])
    slick.release(
        Oil(density=900.0, dynamic_viscosity=0.02, interfacial_tension=0.02),
        1.0,
        count=200,
        center=(6.0, 0.0),
        radius=5.0,
    )
    for step in range(40):
        slick.step(UniformFlow((-0.5, 0.0)), 0.5 * step, 0.5)
    slick.move("boom", line, Immersion(0.0, is_sealed=[True, False]))
    slick.step(UniformFlow((-0.5, 0.0)), 20.0, 0.01)
    lost = sum(rate for rate in closures(slick.pools).values())
    assert (slick.pools.volume[[1, 3]] > 0.1).all()  # both segments have oil on their right
    assert lost[1] == 0.0 < lost[3]


def test_oil_that_strands_stays_where_the_falling_water_leaves_it() -> None:
    slick = Slick(
        SlickSettings(loss_volume=1.0, seed=1),
        [Outline(name="shore", nodes=BEACH.outline(0.0), capacity=0.01, carries=False)],
    )
    slick.release(
        Oil(density=900.0, dynamic_viscosity=0.02, interfacial_tension=0.02),
        0.05,
        count=100,
        center=(0.0, -4.0),
        radius=2.0,
    )
    for step in range(30):
        slick.step(UniformFlow((0.0, 0.3)), float(step), 1.0)
    assert slick.oil.stranded == pytest.approx(0.05)
    stuck = slick.parcels.position.copy()
    slick.move("shore", BEACH.outline(-0.3))
    slick.step(UniformFlow((0.0, 0.3)), 30.0, 1.0)
    assert slick.parcels.position == pytest.approx(stuck)
    assert slick.oil.stranded == pytest.approx(0.05)


def test_the_tubes_of_the_catalogue_weigh_what_they_displace() -> None:
    entry, boom = catalogue()["shore-seal"], of_the_catalogue("shore-seal", 20.0, 10)
    assert boom.float_width == boom.skirt_thickness == entry.base_width == 0.6
    with pytest.raises(ScenarioError, match=r"buoyancy_to_weight is 3, allowed with base_width: 2"):
        lay_out(resolve(load_scenario("shore-seal", overrides=["booms.main.buoyancy_to_weight=3.0"]).scenario))


def test_a_tide_table_that_ends_within_the_run_is_refused_before_it() -> None:
    with pytest.raises(
        ScenarioError, match=r"sea.tide.turns ends at 300 s, allowed: 480 s, the end of the run, or later"
    ):
        build(load_scenario("shore-seal", overrides=["sea.tide.turns=[[0, 1.0], [300, 0.5]]"]).scenario)


def test_a_shore_that_nothing_feels_and_wrong_ones_are_refused_at_once() -> None:
    with pytest.raises(ScenarioError) as caught:
        load_scenario("shore-seal", overrides=["shore.slope=0.0", "sea.tide.turns=[[0,1]]", "shore.capacity=-1.0"])
    assert all(key in str(caught.value) for key in ("shore.slope", "sea.tide.turns", "shore.capacity"))
    with pytest.raises(ScenarioError) as caught:
        load_scenario("shore-seal", overrides=["tank={lower=[-100,-90,-3], upper=[140,60,6]}"])
    assert "shore is given, allowed: at the fidelity none" in str(caught.value)
    assert "sea.tide is given, allowed: at the fidelity none" in str(caught.value)
