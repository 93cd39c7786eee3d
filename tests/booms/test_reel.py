"""A boom that runs off a reel: tension, length paid out, inertia, and the line that holds the wound part."""

from __future__ import annotations

import numpy as np
import pytest

from booms.boom import BoomDesign
from booms.deployment import BoomLayout
from booms.loads import segment_loads
from booms.reel import ReeledBodies, track_of
from coupling.bullet.rigid_body_world import RigidBodyWorld
from scenarios.schema.exercise import ReelSettings
from scenarios.setup.afloat.boom_lines import laid_out, lay_off_reel, paid_out, reel_line, reel_name
from tests.seas import steady_sea

BOOM = BoomDesign(
    length=24.0, segment_count=8, skirt_depth=0.4, freeboard=0.2, buoyancy_to_weight=7.0, skirt_thickness=0.005
).boom()
MOUTH, STIFFNESS, STEP = (0.0, 0.0), 1e5, 0.05


def reeled(out: float) -> tuple[RigidBodyWorld, BoomLayout, list[str]]:
    """A boom on still water with so many metres [m] outside the mouth of its reel, along x."""
    layout = lay_off_reel(BOOM, MOUTH, (out, 0.0), 0.0, "boom")
    world = RigidBodyWorld(sub_step=STEP)
    for body in layout.segments:
        world.add_body(body.name, body.mesh, body.mass_properties, body.position, body.orientation, friction=None)
    for joint in layout.joints:
        world.add_joint(joint.name, joint.body_a, joint.body_b, tuple(joint.point))
    line = reel_line("main", layout, ReelSettings(stiffness=STIFFNESS))
    world.add_line(
        line.name,
        line.body_a,
        None,
        tuple(tuple(point) for point in line.points),
        length=line.length,
        stiffness=line.stiffness,
        relaxation_time=0.02,
    )
    names = [body.name for body in layout.segments]
    sea, track = steady_sea(density=BOOM.water_density), track_of(layout, MOUTH, 0)
    world.set_environment(ReeledBodies([segment_loads(layout.segment, BOOM)] * len(names), sea, [track]), names)
    return world, layout, names


def advance(world: RigidBodyWorld, seconds: float) -> None:
    for _ in range(round(seconds / STEP)):
        world.advance(STEP)


def test_the_tension_at_the_reel_is_the_boats_and_the_length_is_that_ordered() -> None:
    world, layout, names = reeled(out=7.0)
    force = 2000.0
    world.set_applied_wrench(names[-1], np.array([force, 0.0, 0.0, 0.0, 0.0, 0.0]))
    advance(world, 5.0)
    assert world.tension(reel_name("main")) == pytest.approx(force, rel=1e-3)
    assert world.tension(layout.joints[2].name) == pytest.approx(force, rel=1e-3)  # of a wound segment
    rest, reel = world.lines.laid_length(reel_name("main")), reel_name("main")
    for _ in range(round(5.0 / STEP)):  # 0.4 m/s for 5 s
        world.lines.order_length(reel, world.lines.length(reel) + 0.4 * STEP)
        world.advance(STEP)
    assert paid_out("main", layout, MOUTH, world.lines) == pytest.approx(7.0 + 2.0, abs=1e-9)
    advance(world, 5.0)
    stretch = force / STIFFNESS * (rest + 2.0)
    end = world.pose(names[-1])[0] + 0.5 * BOOM.segment_length
    assert end == pytest.approx(laid_out(layout, MOUTH) + 2.0 + stretch, abs=0.01)
    assert world.tension(reel) == pytest.approx(force, rel=1e-3)
    world.close()


def test_a_boat_that_pulls_aside_turns_the_boom_and_not_its_wound_part() -> None:
    world, _, names = reeled(out=9.0)
    world.set_applied_wrench(names[-1], np.array([200.0, 2000.0, 0.0, 0.0, 0.0, 0.0]))
    advance(world, 12.0)
    wound = world.poses(names[:5])
    assert np.abs(wound[:, 1]).max() < 0.01
    assert np.abs(wound[:, 2] - world.pose(names[0])[2]).max() < 0.01
    assert world.pose(names[-1])[1] > 5.0
    # a drum's brake feels the pull along its line only, 200 N and the rest of a swing; round a roller it would be 2010 N
    assert world.tension(reel_name("main")) < 500.0
    world.close()


def test_a_drum_without_its_brake_resists_by_the_mass_that_is_wound_on_it() -> None:
    world, layout, names = reeled(out=1.0)  # half a segment: all middles but the last are behind the mouth
    world.part_line(reel_name("main"))
    world.set_applied_wrench(names[0], np.array([-100.0, 0.0, 0.0, 0.0, 0.0, 0.0]))  # inward, so that nothing leaves
    advance(world, 1.0)
    mass = len(names) * layout.segment.mass_properties.mass
    assert world.twist(names[0])[0] == pytest.approx(-100.0 / mass, rel=0.02)
    world.close()


def test_an_end_that_the_boom_does_not_reach_is_refused() -> None:
    with pytest.raises(
        ValueError, match=r"its end is 30 m from the reel's mouth, allowed: above 0 m and at most its length, 24 m"
    ):
        lay_off_reel(BOOM, MOUTH, (30.0, 0.0), 0.0, "boom")
