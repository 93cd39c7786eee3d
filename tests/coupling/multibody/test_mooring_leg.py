"""A mooring leg: the catenary against its formula, touch-down, several parts, and an anchor that drags."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.multibody.catenary import distance_under, pull_of, span_of
from coupling.multibody.ground_tackle import Anchor, LegPart
from coupling.solids.bodies import box, mass_properties

RIGID = 1e13  # [N], a stiffness that gives nothing
BOX = box((0.5, 0.5, 0.5))
ROPE, CHAIN = LegPart(length=40.0, weight=5.0, stiffness=3e5), LegPart(length=20.0, weight=120.0, stiffness=3e7)


def table(*parts: LegPart) -> np.ndarray:
    return np.array([(part.length, part.weight, part.stiffness) for part in parts])


def test_leg_that_touches_down_pulls_as_the_catenary_formula_says() -> None:
    # a chain that leaves the ground level: V = w s, T = H + w z, z = a (cosh(x / a) - 1), s = a sinh(x / a), a = H / w
    weight, depth, length = 200.0, 20.0, 60.0
    for horizontal in (500.0, 2000.0, 8000.0):
        a = horizontal / weight
        hanging = a * math.sinh(math.acosh(1.0 + depth / a))
        distance = length - hanging + a * math.acosh(1.0 + depth / a)
        pull = pull_of(np.array([[length, weight, RIGID]]), distance, depth, (1.0, 1.0))
        assert pull.horizontal == pytest.approx(horizontal, rel=1e-6)
        assert pull.vertical == pytest.approx(weight * hanging, rel=1e-6)
        assert math.hypot(pull.horizontal, pull.vertical) == pytest.approx(horizontal + weight * depth, rel=1e-6)
        assert pull.at_anchor == 0.0


def test_lifted_leg_is_a_catenary_between_two_points() -> None:
    # s^2 = z^2 + (2 a sinh(x / 2 a))^2 of a chain between points z apart in height and x in distance
    weight, depth, length, distance = 200.0, 20.0, 60.0, 56.2
    a = brentq(lambda a: math.hypot(depth, 2.0 * a * math.sinh(0.5 * distance / a)) - length, 5.0, 5000.0)
    pull = pull_of(np.array([[length, weight, RIGID]]), distance, depth, (1.0, 1.0))
    assert pull.horizontal == pytest.approx(weight * a, rel=1e-6)
    assert pull.vertical - pull.at_anchor == pytest.approx(weight * length, rel=1e-9)
    assert pull.at_anchor > 0.0


def test_elastic_parts_span_the_integral_of_their_slopes() -> None:
    # dx = (1 + T / EA) H / T ds, dz = (1 + T / EA) V / T ds, V = V_top - w s: summed over s by quadrature
    parts, horizontal, top = table(ROPE, CHAIN), 900.0, 2700.0
    x = z = 0.0
    for length, weight, stiffness in parts:

        def along(s: float, share: bool, top=top, weight=weight, stiffness=stiffness) -> float:
            v = top - weight * s
            t = math.hypot(horizontal, v)
            return (1.0 + t / stiffness) * (horizontal if share else v) / t

        x += quad(along, 0.0, length, args=(True,))[0]
        z += quad(along, 0.0, length, args=(False,))[0]
        top -= weight * length
    found = span_of(parts, horizontal, 2700.0)
    assert found[:2] == pytest.approx([x, z], rel=1e-9)
    assert found[6] == pytest.approx(top)
    pull = pull_of(parts, x, z, (1.0, 1.0))
    assert (pull.horizontal, pull.vertical) == pytest.approx((horizontal, 2700.0), rel=1e-6)


def test_stiffness_is_the_slope_of_the_pull() -> None:
    parts, step = table(ROPE, CHAIN), 1e-4
    for distance in (52.0, 56.0, 57.5, 58.5):
        pulls = [pull_of(parts, distance + shift, 15.0, (1.0, 1.0)) for shift in (-step, 0.0, step)]
        slope = (pulls[2].horizontal - pulls[0].horizontal) / (2.0 * step)
        assert pulls[1].stiffness == pytest.approx(slope, rel=1e-5)


@pytest.mark.parametrize("vertical", [30.0, 700.0, 3200.0], ids=["rope on the ground", "chain on the ground", "lifted"])
def test_spans_have_the_derivatives_that_they_tell(vertical: float) -> None:
    """By central differences; a weightless bridle hangs over rope and chain, and all give much."""
    soft = np.array([[5.0, 0.0, 2e4], [40.0, 5.0, 3e4], [20.0, 120.0, 3e5]])
    horizontal, step = 400.0, 1e-2
    found = span_of(soft, horizontal, vertical)
    by_h = (span_of(soft, horizontal + step, vertical) - span_of(soft, horizontal - step, vertical)) / (2.0 * step)
    by_v = (span_of(soft, horizontal, vertical + step) - span_of(soft, horizontal, vertical - step)) / (2.0 * step)
    assert found[2:6] == pytest.approx([by_h[0], by_v[0], by_h[1], by_v[1]], rel=1e-6)


@pytest.mark.parametrize("vertical", [30.0, 700.0, 3200.0], ids=["rope on the ground", "chain on the ground", "lifted"])
def test_a_part_spans_what_its_halves_span(vertical: float) -> None:
    soft = np.array([[40.0, 5.0, 3e4], [20.0, 120.0, 3e5]])
    halves = np.repeat(soft, 2, axis=0) * [0.5, 1.0, 1.0]
    assert span_of(halves, 400.0, vertical) == pytest.approx(span_of(soft, 400.0, vertical), rel=1e-12)


@pytest.mark.parametrize("guess", [(1e-3, 0.0), (1.0, 1.0), (1e6, 1e6)])
def test_the_pull_does_not_hang_on_the_guess(guess: tuple[float, float]) -> None:
    for distance in (30.0, 52.0, 58.0, 60.5):
        pull, wanted = (pull_of(table(ROPE, CHAIN), distance, 15.0, start) for start in (guess, (900.0, 2500.0)))
        assert pull == pytest.approx(wanted, rel=1e-6)


def test_weightless_rope_is_a_spring() -> None:
    pull = pull_of(np.array([[10.0, 0.0, 1e4]]), 8.0, 6.6, (1.0, 1.0))
    stretched = math.hypot(8.0, 6.6)
    tension = 1e4 * (stretched / 10.0 - 1.0)
    assert math.hypot(pull.horizontal, pull.vertical) == pytest.approx(tension, rel=1e-6)
    assert pull.vertical / pull.horizontal == pytest.approx(6.6 / 8.0, rel=1e-6)


def test_slack_leg_pulls_only_by_what_hangs() -> None:
    pull = pull_of(table(CHAIN), 2.0, 15.0, (1.0, 1.0))
    assert pull.horizontal == pull.stiffness == pull.at_anchor == 0.0
    assert pull.vertical == pytest.approx(120.0 * 15.0, rel=1e-3)  # and stretches by a thousandth of that


@pytest.fixture
def world() -> Iterator[RigidBodyWorld]:
    world = RigidBodyWorld(gravity=(0.0, 0.0, 0.0), sub_step=0.1)
    world.add_body("buoy", BOX, mass_properties(BOX, mass=500.0), (50.0, 0.0, 15.0))
    yield world
    world.close()


def moor(world: RigidBodyWorld, anchor: Anchor) -> None:
    world.add_mooring_leg("leg", "buoy", (50.0, 0.0, 15.0), (ROPE, CHAIN), anchor, relaxation_time=0.1)


def tow(world: RigidBodyWorld, pull: float, seconds: float) -> None:
    """Pull the buoy along x, held up against the leg's weight, with a resistance that lets it creep."""
    for _ in range(round(seconds / 0.1)):
        held = world.lines["leg"].pull_now.vertical
        speed = world.twist("buoy")
        world.set_applied_wrench(
            "buoy", np.array([pull, 0.0, held, *(-200.0 * speed[3:])]) - 1500.0 * np.eye(6)[:3].T @ speed[:3]
        )
        world.advance(0.1)


def test_moored_body_rests_where_its_leg_balances_the_pull(world: RigidBodyWorld) -> None:
    moor(world, Anchor(place=(0.0, 0.0, 0.0)))
    tow(world, 800.0, 30.0)
    x, _, z = world.pose("buoy")[:3]
    assert distance_under(table(ROPE, CHAIN), z, 800.0)[0] == pytest.approx(x, abs=2e-3)
    assert world.tension("leg") == pytest.approx(math.hypot(800.0, world.lines["leg"].pull_now.vertical), rel=1e-3)


def test_anchor_drags_beyond_its_holding_power_and_holds_again(world: RigidBodyWorld) -> None:
    moor(world, Anchor(place=(0.0, 0.0, 0.0), holding=600.0))
    leg = world.lines["leg"]
    tow(world, 500.0, 20.0)
    assert leg.dragged == 0.0
    tow(world, 900.0, 20.0)
    assert leg.pull_now.horizontal == pytest.approx(600.0, abs=0.01)
    x, _, z = world.pose("buoy")[:3]
    assert leg.dragged == pytest.approx(x - distance_under(table(ROPE, CHAIN), z, 600.0)[0], abs=0.05)
    there = leg.dragged
    tow(world, 500.0, 20.0)
    assert leg.dragged == pytest.approx(there, abs=0.05)
    assert leg.pull_now.horizontal == pytest.approx(500.0, rel=1e-2)


def test_pull_upwards_costs_holding_power() -> None:
    hook = Anchor(place=(0.0, 0.0, 0.0), holding=1000.0, angle_loss=1.0)
    assert hook.power(800.0, 0.0) == 1000.0
    assert hook.power(800.0, 800.0) == pytest.approx(1000.0 * (1.0 - 0.25 * math.pi))
    weight = Anchor(place=(0.0, 0.0, 0.0), holding=500.0, friction=0.5)
    assert weight.power(100.0, 600.0) == pytest.approx(200.0)
    assert weight.power(100.0, 2000.0) == 0.0


def test_leg_parts_at_its_breaking_load(world: RigidBodyWorld) -> None:
    weak = LegPart(length=40.0, weight=5.0, stiffness=3e5, breaking_load=1500.0)
    world.add_mooring_leg("leg", "buoy", (50.0, 0.0, 15.0), (weak, CHAIN), Anchor(place=(0.0, 0.0, 0.0)))
    leg = world.lines["leg"]
    tow(world, 600.0, 15.0)
    assert not leg.parted
    tow(world, 3000.0, 15.0)
    assert leg.parted
    assert world.tension("leg") == 0.0


def test_leg_goes_on_bit_for_bit_from_a_saved_state(world: RigidBodyWorld) -> None:
    moor(world, Anchor(place=(0.0, 0.0, 0.0), holding=600.0))
    tow(world, 900.0, 10.0)
    saved = world.save_state()
    tow(world, 900.0, 5.0)
    pose, dragged = world.pose("buoy"), world.lines["leg"].dragged
    world.restore_state(saved)
    tow(world, 900.0, 5.0)
    assert np.array_equal(world.pose("buoy"), pose)
    assert world.lines["leg"].dragged == dragged > 0.0


def test_windlass_changes_the_uppermost_part(world: RigidBodyWorld) -> None:
    moor(world, Anchor(place=(0.0, 0.0, 0.0)))
    world.lines.order_length("leg", 55.0)
    world.advance(0.1)
    assert world.lines["leg"].table[:, 0].tolist() == pytest.approx([35.0, 20.0])
    with pytest.raises(ValueError, match=r"length of a mooring leg is 19 m, allowed: above 20 m"):
        world.lines["leg"].pay_out(19.0)


@pytest.mark.parametrize(
    ("change", "said"),
    [({"length": 0.0}, "length"), ({"weight": -1.0}, "weight"), ({"stiffness": math.inf}, "stiffness")],
)
def test_impossible_parts_are_refused(world: RigidBodyWorld, change: dict[str, float], said: str) -> None:
    part = LegPart(**({"length": 10.0, "weight": 1.0, "stiffness": 1e5} | change))
    with pytest.raises(ValueError, match=f"{said} of a mooring leg's part"):
        world.add_mooring_leg("leg", "buoy", (50.0, 0.0, 15.0), (part,), Anchor(place=(0.0, 0.0, 0.0)))
