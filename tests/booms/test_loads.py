"""A boom loaded by formulas: it floats at its design waterline, keeps to the Navy's rule, and takes the catenary's shape and tension."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from booms.boom import BoomDesign
from booms.deployment import lay_between
from booms.loads import freeboard_drag, segment_loads, skirt_drag
from booms.segments import boom_segment
from coupling.bullet.rigid_body_world import RigidBodyWorld
from oilsim.loads.load_model import LoadModel
from oilsim.loads.morison import FloatingBodies
from tests.seas import steady_sea

RHO = 1027.0
DESIGN = BoomDesign(
    length=60.0,
    segment_count=20,
    skirt_depth=0.6,
    freeboard=0.3,
    buoyancy_to_weight=6.0,
    skirt_thickness=0.02,
    ballast_fraction=0.7,
)


def test_coefficients_are_the_navys():
    assert skirt_drag(1027.0) == pytest.approx(1.88, abs=0.005)
    assert freeboard_drag() == pytest.approx(0.98, abs=0.005)


def test_segment_floats_at_its_design_waterline_and_keeps_to_the_rule():
    """At rest the lift is its weight; 26 A V^2 kgf at 1 knot on its skirt, and 26 A (V / 40)^2 at 20 knots of wind on its freeboard."""
    boom = DESIGN.boom()
    segment = boom_segment(boom)
    model, pose = segment_loads(segment, boom), np.zeros((1, 7))
    pose[0, 2], pose[0, 6] = -segment.waterline, 1.0
    still = FloatingBodies([model], steady_sea(density=RHO)).loads(0.0, pose, np.zeros((1, 6)))
    assert still.wrench[0, 2] == pytest.approx(segment.mass_properties.mass * 9.81, rel=1e-9)
    current = FloatingBodies([model], steady_sea(density=RHO, current=(0.0, 0.514444))).loads(
        0.0, pose, np.zeros((1, 6))
    )
    assert current.wrench[0, 1] == pytest.approx(26 * 9.80665 * 3.0 * 0.6, rel=1e-4)
    wind = FloatingBodies([model], steady_sea(wind=(0.0, 10.28889))).loads(0.0, pose, np.zeros((1, 6)))
    assert wind.wrench[0, 1] == pytest.approx(26 * 9.80665 * 3.0 * 0.3 * (20 / 40) ** 2, rel=1e-4)


def along_normal_only(model: LoadModel) -> LoadModel:
    """The same without friction along the boom, as the exact catenary has it."""
    stations = [replace(station, drag_area=station.drag_area * (0, 1, 1)) for station in model.stations]
    return LoadModel(parts=model.parts, stations=tuple(stations))


@pytest.mark.parametrize(
    ("segments", "tension", "sag"), [(20, 0.04, 0.012), pytest.param(40, 0.01, 0.003, marks=pytest.mark.slow)]
)
def test_moored_boom_takes_the_shape_and_tension_of_the_catenary(segments, tension, sag):
    """Gap 0.3 L, normal drag only: T = 0.0500 q d L, sag = 0.4525 L (`tests/booms/data/boom_catenary.csv`); 40 segments: tension
    1 %, sag 0.3 % of L; 20 segments: 3 %, as the chain has corners.
    """
    boom = replace(DESIGN, segment_count=segments).boom()
    speed, gap = 0.36, 0.3 * boom.length
    layout = lay_between(boom, (0.0, 0.0), (gap, 0.0), water_level=0.0)
    world = RigidBodyWorld(sub_step=0.05)
    for body in layout.segments:
        world.add_body(body.name, body.mesh, body.mass_properties, body.position, body.orientation, friction=None)
    for joint in layout.joints:
        world.add_joint(joint.name, joint.body_a, joint.body_b, tuple(joint.point))
    for end, body in zip(layout.end_points, (layout.segments[0], layout.segments[-1]), strict=True):
        world.add_joint(f"hold {body.name}", body.name, None, tuple(end))
    model = along_normal_only(segment_loads(layout.segment, boom))
    names = [body.name for body in layout.segments]
    water = steady_sea(density=RHO, current=(0.0, -speed))
    world.set_environment(FloatingBodies([model] * len(names), water), names)
    tensions = []
    for _ in range(1200):
        world.advance(0.05)
        tensions.append([world.tension(f"hold {name}") for name in (names[0], names[-1])])
    depth = -min(world.pose(name)[1] for name in names)
    drafts = [world.pose(name)[2] + layout.segment.waterline for name in names]
    world.close()
    dynamic = 0.5 * 1027.0 * skirt_drag(1027.0) * speed**2 * boom.skirt_depth * boom.length
    assert np.mean(tensions[-300:]) / dynamic == pytest.approx(0.0500, rel=tension)
    assert depth / boom.length == pytest.approx(0.4525, abs=sag)
    assert np.abs(drafts).max() < 0.02
