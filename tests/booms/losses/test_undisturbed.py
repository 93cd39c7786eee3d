"""What drives the closures: the flow and the surface before a boom, by formulas, and how fast the boom's speed follows them."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from booms.boom import Boom
from booms.boom_state import BoomState
from booms.containment import Containment, ContainmentOptions
from booms.deployment import lay_along
from booms.losses.closure_losses import INTERVAL, ClosureLosses, LostBoom
from booms.losses.liquids import OilOnWater
from booms.losses.rates import Closures
from booms.losses.undisturbed import flow_ahead, forced_flow, surface_ahead
from oilsim import Fluid, FluidConfig, Phase, block
from oilsim.sea import RegularWaves, SeaForcing, Zone
from tests.seas import current_in, shallow_sea

Array = NDArray[np.float64]

SPACING, DRAFT, FREEBOARD, LEVEL, SEGMENTS, LENGTH = 0.1, 0.2, 0.1, 0.8, 4, 2.0  # m
REACH = LENGTH / SEGMENTS / 2.0  # m, half a segment
MIDDLE = np.array([1.5, 1.5])
BOX = ((0.0, 0.0, 0.0), (3.0, 3.0, 1.6))
ZONE = Zone(*BOX, 0.5)
PHASES = (
    Phase(name="water", rest_density=1027.0, dynamic_viscosity=1e-3),
    Phase(name="oil", rest_density=868.0, dynamic_viscosity=1e-2),
)
BOOM = Boom(
    length=LENGTH, segment_count=SEGMENTS, skirt_depth=DRAFT, freeboard=FREEBOARD, float_width=0.08, float_draft=0.03,
    skirt_thickness=0.06, design_skirt_thickness=0.005,
)  # fmt: skip
OPEN = (0.0, 0.0)  # periods [m] of a sea that does not repeat


def turned(angle: float) -> Array:
    """Return the unit vectors (2, 2) out of a straight boom and along it, turned by an angle [rad]; along lies 90 degrees left of out."""
    return np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])


def straight(angle: float = 0.0, rise: float = 0.0) -> BoomState:
    """Return a straight boom at rest through `MIDDLE`, whose skirt looks along `angle` [rad], and that stands out by `rise` [m]."""
    ways = np.linspace(-0.5 * LENGTH, 0.5 * LENGTH, SEGMENTS + 1)
    layout = lay_along(BOOM, MIDDLE + ways[:, None] * turned(angle)[1], water_level=LEVEL)
    return BoomState(
        position=np.array([body.position for body in layout.segments]) + np.array([0.0, 0.0, rise]),
        orientation=np.array([body.orientation for body in layout.segments]),
        velocity=np.zeros((SEGMENTS, 3)),
        joint_points=layout.segment.joint_points,
        waterline=layout.segment.waterline,
    )


def middles(angle: float) -> Array:
    """Return the middles (S, 2) [m] of the segments."""
    ways = (np.arange(SEGMENTS) + 0.5) * LENGTH / SEGMENTS - 0.5 * LENGTH
    return MIDDLE + ways[:, None] * turned(angle)[1]


def water(angle: float, below: float) -> tuple[Array, NDArray[np.bool_]]:
    """Return places (N, 3) [m] of water before the whole boom, and which of them (N,) count: 2 to 4 drafts ahead, a draft thick."""
    ahead, along, deep = np.meshgrid(
        np.arange(0.05, 1.5, SPACING), np.arange(-0.95, 1.0, SPACING), np.arange(0.05, 0.8, SPACING), indexing="ij"
    )
    ahead, along, deep = ahead.ravel(), along.ravel(), deep.ravel()
    plan = MIDDLE + np.stack([-ahead, along], axis=1) @ turned(angle)
    counts = (ahead > 2 * DRAFT) & (ahead < 4 * DRAFT) & (deep > below) & (deep < below + DRAFT)
    return np.column_stack([plan, LEVEL - deep]), counts


@pytest.mark.parametrize("angle", [0.0, 0.9, 4.0])
def test_the_flow_ahead_is_that_two_to_four_drafts_before_the_segment(angle: float) -> None:
    """A flow that grows with the way: the mean is that 3 drafts ahead. All other water runs at 50 m/s, and so does the oil's layer."""
    place, counts = water(angle, below := 0.1)
    speed = np.array([0.4, -0.3]) + place[:, :2] @ np.array([[0.5, 0.2], [-0.1, 0.3]])
    velocity = np.where(counts[:, None], np.column_stack([speed, np.ones(len(speed))]), 50.0)
    found = flow_ahead(
        place, velocity, straight(angle), draft=DRAFT, level=LEVEL, below=np.full(SEGMENTS, below), period=OPEN
    )
    there = middles(angle) - 3 * DRAFT * turned(angle)[0]
    aside = SPACING / 2  # by which the water beside a segment may lie off its middle
    expected = np.array([0.4, -0.3]) + there @ np.array([[0.5, 0.2], [-0.1, 0.3]])
    np.testing.assert_allclose(found, expected, atol=0.5 * aside)


def test_a_uniform_flow_is_met_by_every_segment_with_water_before_it() -> None:
    """The others know of none: before the last one there is no water, and before the first only under a deep slick."""
    place, _ = water(0.0, 0.1)
    place = place[(place[:, 1] < MIDDLE[1] + 0.5 * LENGTH - 2.0 * REACH) & (place[:, 2] > LEVEL - 0.6)]
    below = np.array([0.7, 0.1, 0.1, 0.1])
    velocity = np.tile([-0.7, 0.25, 0.1], (len(place), 1))
    found = flow_ahead(place, velocity, straight(), draft=DRAFT, level=LEVEL, below=below, period=OPEN)
    np.testing.assert_allclose(found[1:3], np.tile([-0.7, 0.25], (2, 1)), rtol=1e-12)
    assert np.isnan(found[[0, 3]]).all()


@pytest.fixture
def fluid() -> Iterator[Fluid]:
    """Make a box without liquid, that does not repeat."""
    one = Fluid(FluidConfig(particle_spacing=SPACING, phases=PHASES, lower=BOX[0], upper=BOX[1]), threads=1)
    yield one
    one.close()


def test_forced_flow_is_the_current_and_the_orbital_velocity_of_the_waves(fluid: Fluid) -> None:
    """a omega cosh(k (h + z)) / sinh(k h) cos(k s - omega t) along the waves' heading, z below the still water; none without a forcing."""
    height, period, direction, depth, time = 0.1, 1.3, 0.7, LEVEL, 2.1
    assert forced_flow(fluid, straight(0.4), LEVEL - 0.1, OPEN) is None
    waves = RegularWaves(height=height, period=period, direction=direction, stretching="none")
    fluid.add_forcing(SeaForcing(shallow_sea(LEVEL, current=(0.3, -0.2), waves=waves), spacing=SPACING, zones=[ZONE]))
    fluid.time = time
    omega = 2.0 * math.pi / period
    k = brentq(lambda k: 9.81 * k * math.tanh(k * depth) - omega**2, 1e-3, 100.0)
    to = np.array([math.cos(direction), math.sin(direction)])
    for below in (0.1, 0.4):
        size = 0.5 * height * omega * math.cosh(k * (depth - below)) / math.sinh(k * depth)
        along = size * np.cos(
            k * ((middles(0.4) - time * np.array([0.3, -0.2])) @ to) - omega * time
        )  # the current carries them
        found = forced_flow(fluid, straight(0.4), LEVEL - below, OPEN)
        assert found is not None
        np.testing.assert_allclose(found, np.array([0.3, -0.2]) + np.outer(along, to), atol=1e-4)


SLOPE = np.array([0.1, -0.05])


@pytest.mark.parametrize("angle", [0.0, 2.2])
def test_the_surface_ahead_is_that_of_a_slope_before_the_segment(fluid: Fluid, angle: float) -> None:
    """Columns of particles whose tops follow a plane; within a support across, particles lie a quarter of a spacing off its middle."""
    columns = block((0.0, 0.0, 0.0), (3.0, 3.0, SPACING), SPACING)[:, :2]
    tops = LEVEL + (columns - MIDDLE) @ SLOPE
    points = [np.column_stack([columns, tops - (n + 0.5) * SPACING]) for n in range(4)]
    fluid.add_particles(np.concatenate(points), phase="water")
    for ahead in (0.0, 0.4):
        there = middles(angle) - ahead * turned(angle)[0]
        found = surface_ahead(fluid, straight(angle), ahead, LEVEL, 2.0 * DRAFT)
        np.testing.assert_allclose(found, LEVEL + (there - MIDDLE) @ SLOPE, atol=0.25 * SPACING * np.hypot(*SLOPE))


def test_the_surface_beside_a_wall_is_the_still_level(fluid: Fluid) -> None:
    """Water a little higher stands before the first half of the boom, and beyond a wall there is none, or a film far down."""
    fluid.add_particles(block((0.0, 0.0, 0.0), (3.0, 1.3, 0.9), SPACING), phase="water")
    fluid.add_particles(block((0.0, 2.2, 0.0), (3.0, 3.0, 0.2), SPACING), phase="water")
    found = surface_ahead(fluid, straight(), 0.3, LEVEL, 2.0 * DRAFT)
    assert found == pytest.approx([0.9, 0.9, LEVEL, LEVEL], abs=1e-6)


def looker() -> tuple[ClosureLosses, Containment]:
    """Return the closures of the straight boom, and the account of its oil."""
    oil = OilOnWater(oil_density=868.0, water_density=1027.0, kinematic_viscosity=1.2e-5, interfacial_tension=0.02)
    boom = LostBoom(
        closures=Closures(skirt_depth=DRAFT), oils={"oil": oil}, waters=["water"], segments=SEGMENTS,
        segment_length=LENGTH / SEGMENTS, freeboard=FREEBOARD, float_width=0.08, spacing=SPACING,
    )  # fmt: skip
    options = ContainmentOptions(skirt_depth=DRAFT, freeboard=FREEBOARD, particle_volume=SPACING**3, hysteresis=SPACING)
    return ClosureLosses(boom), Containment(options)


def test_speed_and_draft_follow_in_the_time_that_water_takes_to_pass_the_draft(fluid: Fluid) -> None:
    """They close the gap as exp(-t U / d), with U the mean itself, 0.2 m/s at least; the draft ends at what the risen boom has."""
    fast, rise = 0.9, 0.05
    fluid.add_particles(block((0.0, 0.0, 0.0), (3.0, 3.0, LEVEL), SPACING), phase="water")
    stream = current_in(ZONE, (fast, 0.4), LEVEL)  # the part along the boom does not count
    fluid.add_forcing(stream)
    (closures, tracker), state = looker(), straight(rise=rise)
    speed, left = 0.0, 1.0
    for look in range(12):
        closures.act(look * INTERVAL, fluid, tracker, state, LEVEL)
        if look == 8:  # away from the boom, against which the mean still runs
            stream.sea = shallow_sea(LEVEL, current=(-fast, 0.0))
        share = math.exp(-INTERVAL * max(speed, 0.2) / DRAFT) if look else 1.0
        speed, left = share * speed + (1.0 - share) * (fast if look <= 8 else -fast), share * left
        saved = closures.save_state()
        np.testing.assert_allclose(saved["speed"], speed, rtol=1e-6, atol=1e-12)
        np.testing.assert_allclose(saved["draft"], DRAFT - rise * (1.0 - left), rtol=1e-6)
