"""Closures of a boom that has sailed on past the sides of a sea that repeats: they see what they would see in the middle of it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from numpy.typing import NDArray

from booms.boom import Boom
from booms.boom_state import BoomState
from booms.containment import Containment, ContainmentOptions
from booms.losses.closure_losses import INTERVAL, ClosureLosses, LostBoom
from booms.losses.liquids import OilOnWater
from booms.losses.rates import Closures
from booms.losses.resolution import Resolution
from booms.losses.undisturbed import forced_flow
from oilsim import Fluid, FluidConfig, Phase, block
from oilsim.sea import RegularWaves, SeaForcing, Zone
from tests.booms.laid import lay_u
from tests.seas import shallow_sea

Array = NDArray[np.float64]

SPACING, DRAFT, FREEBOARD, WIDTH, LEVEL = 0.1, 0.2, 0.1, 0.08, 0.8  # m: WIDTH of the float
SEA, STREAM, LOOKS = (4.0, 3.0), 0.9, 23  # m, m/s, looks of the closures
BOOM = Boom(
    length=3.0, segment_count=12, skirt_depth=DRAFT, freeboard=FREEBOARD, float_width=WIDTH, float_draft=0.03, skirt_thickness=0.06,
    design_skirt_thickness=0.005,
)  # fmt: skip
LAYOUT = lay_u(BOOM, (2.5, 1.5), 0.0, 0.35, water_level=LEVEL)
APEX = min(float(joint.point[0]) for joint in LAYOUT.joints)
OIL = OilOnWater(oil_density=868.0, water_density=1027.0, kinematic_viscosity=1.2e-5, interfacial_tension=0.02)
WAYS = [(0.0, 0.0), (-1.8, 0.0), (2.5, 1.4), (4.0, 0.0), (10.3, -7.4)]


def boom_at(way: tuple[float, float]) -> BoomState:
    """Return the boom at rest, moved by a way [m]."""
    count = len(LAYOUT.segments)
    return BoomState(
        position=np.array([body.position for body in LAYOUT.segments]) + np.array([*way, 0.0]),
        orientation=np.array([body.orientation for body in LAYOUT.segments]),
        velocity=np.zeros((count, 3)),
        joint_points=LAYOUT.segment.joint_points,
        waterline=LAYOUT.segment.waterline,
    )


@contextmanager
def stream(way: tuple[float, float]) -> Iterator[Fluid]:
    """Make a stream with oil before the apex, all moved by a way [m] and let in again at the other side; it ends with the block."""
    phases = (
        Phase(name="water", rest_density=1027.0, dynamic_viscosity=1e-3),
        Phase(name="oil", rest_density=868.0, dynamic_viscosity=1e-2),
    )
    fluid = Fluid(
        FluidConfig(
            particle_spacing=SPACING, phases=phases, lower=(0.0, 0.0, 0.0), upper=(*SEA, 1.2), periodic=(True, True, False),
        ),
        threads=1,
    )  # fmt: skip
    points = block((0.0, 0.0, 0.0), (*SEA, LEVEL), SPACING)
    points += 0.02 * SPACING * np.random.default_rng(1).uniform(-1.0, 1.0, points.shape)  # no two are equally near
    across = np.abs(points[:, 1] - 1.5)
    pool = (points[:, 0] > APEX) & (points[:, 0] < APEX + 0.6) & (across < 0.3) & (points[:, 2] > LEVEL - SPACING)
    points[:, :2] = (points[:, :2] + way) % SEA
    try:
        fluid.add_particles(points[~pool], phase="water", velocity=(-STREAM, 0.0, 0.0))
        fluid.add_particles(points[pool], phase="oil")
        yield fluid
    finally:
        fluid.close()


def looked(way: tuple[float, float]) -> tuple[float, list[int]]:
    """Let closures look at a stream that stands still; the last rate [m3/s], and who is out by them."""
    boom = LostBoom(
        closures=Closures(skirt_depth=DRAFT, resolution=Resolution(spacing=SPACING, skirt_depth=DRAFT)),
        oils={"oil": OIL}, waters=["water"], segments=len(LAYOUT.segments), segment_length=0.25, freeboard=FREEBOARD,
        float_width=WIDTH, spacing=SPACING, period=SEA,
    )  # fmt: skip
    options = ContainmentOptions(
        skirt_depth=DRAFT, freeboard=FREEBOARD, particle_volume=SPACING**3, hysteresis=SPACING, period=SEA
    )
    tracker, closures, state = Containment(options), ClosureLosses(boom), boom_at(way)
    with stream(way) as fluid:
        for look in range(LOOKS):
            time = look * INTERVAL
            closures.act(time, fluid, tracker, state, LEVEL)
            tracker.update(time, state, fluid.phase_positions("oil"), fluid.phase_ids("oil"), water_level=LEVEL)
        standing = tracker.standing()
        return closures.rate, standing.ids[standing.modelled].tolist()


@pytest.fixture(scope="module")
def in_the_middle() -> tuple[float, list[int]]:
    return looked((0.0, 0.0))


def test_closures_lose_oil_in_the_middle(in_the_middle: tuple[float, list[int]]) -> None:
    rate, out = in_the_middle
    assert rate > 1e-4
    assert len(out) >= 2


@pytest.mark.parametrize("way", WAYS[1:])
def test_closures_see_the_same_wherever_the_boom_has_sailed(
    way: tuple[float, float], in_the_middle: tuple[float, list[int]]
) -> None:
    """Across a side, across a corner, a whole period on, and some periods on: the same rate, and the same particles."""
    rate, out = looked(way)
    assert rate == pytest.approx(in_the_middle[0], rel=1e-4)  # positions are rounded otherwise there
    assert out == in_the_middle[1]


def test_a_boom_beyond_the_sea_meets_the_waves_in_it() -> None:
    """Waves that do not fit into the length of the sea."""
    with stream((0.0, 0.0)) as fluid:
        zone = Zone((0.0, 0.0, 0.0), (1.0, 3.0, 1.2), 0.5)
        sea = shallow_sea(LEVEL, waves=RegularWaves(height=0.1, period=1.3))
        fluid.add_forcing(SeaForcing(sea, spacing=0.1, zones=[zone]))
        fluid.time = 2.0
        flows = [forced_flow(fluid, boom_at(way), 0.7, SEA) for way in ((0.0, 0.0), (4.0, 0.0), (-8.0, 3.0))]
    assert flows[0] is not None and np.ptp(flows[0]) > 0.01
    for flow in flows[1:]:
        np.testing.assert_allclose(flow, flows[0], atol=1e-6)
