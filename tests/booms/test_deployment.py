"""Booms laid in a U or a line: shape, closed joints, no gaps; and tow lines."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from booms.boom import Boom
from booms.deployment import catenary_chain, lay_between, stream_chain, tow_line
from tests.booms.laid import lay_u


def make_boom(segment_count=24, length=6.0):
    return Boom(
        length=length,
        segment_count=segment_count,
        skirt_depth=0.2,
        freeboard=0.1,
        float_width=0.08,
        float_draft=0.03,
        skirt_thickness=0.06,
        design_skirt_thickness=0.005,
        maximum_turn=math.radians(75.0),
    )


def world_points(body, points):
    return Rotation.from_quat(body.orientation).apply(points) + body.position


def test_chain_has_equal_links_and_the_asked_gap():
    for count in (6, 20, 61):
        for gap in (0.1, 0.333, 0.9):
            chain = catenary_chain(count, gap)
            assert np.linalg.norm(np.diff(chain, axis=0), axis=1) == pytest.approx(1.0 / count, rel=1e-12)
            assert chain[-1] - chain[0] == pytest.approx([gap, 0.0], abs=1e-9)


@pytest.mark.parametrize("gap", [0.2, 0.333, 0.6, 0.9])
def test_fine_chain_is_the_catenary(gap):
    # y = a cosh(x / a) with 2 a sinh(gap / 2 a) = 1, sag = a (cosh(gap / 2 a) - 1); a by fixed-point bisection
    low, high = 1e-3, 10.0
    for _ in range(100):
        a = 0.5 * (low + high)
        low, high = (a, high) if 2 * a * np.sinh(min(gap / (2 * a), 300.0)) > 1.0 else (low, a)
    chain = catenary_chain(400, gap)
    assert -chain[:, 1].min() == pytest.approx(a * (np.cosh(gap / (2 * a)) - 1.0), rel=1e-3)


@pytest.mark.parametrize("heading", [0.0, math.pi / 2, 2.5])
def test_u_opens_towards_the_tow(heading):
    layout = lay_u(make_boom(), (1.0, 2.0), heading, 0.35, water_level=0.6)
    assert layout.gap_ratio == pytest.approx(0.35, rel=1e-9)
    ahead, port = np.array([math.cos(heading), math.sin(heading)]), np.array([-math.sin(heading), math.cos(heading)])
    ends = layout.end_points[:, :2] - [1.0, 2.0]
    assert ends @ ahead == pytest.approx([0.0, 0.0], abs=1e-9)
    assert ends @ port == pytest.approx([0.5 * 0.35 * 6.0, -0.5 * 0.35 * 6.0])  # first end to port
    astern = [(body.position[:2] - [1.0, 2.0]) @ ahead for body in layout.segments]
    assert max(astern) < 0.0 and np.argmin(astern) in (11, 12)  # the apex lies astern, in the middle


def test_joints_are_closed_at_the_start():
    layout = lay_u(make_boom(), (0.0, 0.0), 0.3, 0.3, water_level=0.5)
    bodies = {body.name: body for body in layout.segments}
    first, last = layout.segment.joint_points
    assert len(layout.joints) == 23
    for joint in layout.joints:
        assert world_points(bodies[joint.body_a], last) == pytest.approx(joint.point, abs=1e-9)
        assert world_points(bodies[joint.body_b], first) == pytest.approx(joint.point, abs=1e-9)
    assert world_points(layout.segments[0], first) == pytest.approx(layout.end_points[0], abs=1e-9)


def test_segments_leave_no_gap_and_overlap_only_where_they_turn():
    boom = make_boom()
    layout = lay_u(boom, (0.0, 0.0), 0.0, 0.3, water_level=0.5)
    for joint, before, after in zip(layout.joints, layout.segments[:-1], layout.segments[1:], strict=True):
        # seen from the vertical plane through the joint that halves the turn, each segment reaches to its edge and a little over
        axes = [Rotation.from_quat(body.orientation).apply([1.0, 0.0, 0.0]) for body in (before, after)]
        normal = (axes[0] + axes[1]) / np.linalg.norm(axes[0] + axes[1])
        half_turn = 0.5 * math.acos(min(axes[0] @ axes[1], 1.0))
        behind = (world_points(before, before.mesh.vertices) - joint.point) @ normal
        ahead = (world_points(after, after.mesh.vertices) - joint.point) @ normal
        largest = 0.5 * boom.float_width * math.sin(half_turn) + 1e-9
        assert -1e-9 < behind.max() < largest
        assert -1e-9 < -ahead.min() < largest


def test_segments_float_at_the_water_level():
    layout = lay_u(make_boom(), (0.0, 0.0), 0.0, 0.3, water_level=0.5)
    for body in layout.segments:
        heights = world_points(body, body.mesh.vertices)[:, 2]
        assert (heights.min(), heights.max()) == pytest.approx((0.5 - 0.2, 0.5 + 0.1), abs=1e-9)


def test_straight_line_between_two_points():
    layout = lay_between(make_boom(), (1.0, 0.0), (1.0, 6.0), water_level=0.0)
    line = np.array([body.position[:2] for body in layout.segments])
    assert line[:, 0] == pytest.approx(1.0)
    assert line[:, 1] == pytest.approx((np.arange(24) + 0.5) * 0.25)


def test_slack_line_hangs_to_the_right():
    layout = lay_between(make_boom(), (0.0, 0.0), (4.0, 0.0), water_level=0.0)
    assert min(body.position[1] for body in layout.segments) < -1.0


def test_what_cannot_be_laid_is_refused():
    with pytest.raises(ValueError, match=r"are 7 m apart"):
        lay_between(make_boom(), (0.0, 0.0), (7.0, 0.0), water_level=0.0)
    with pytest.raises(ValueError, match="too narrow for 5 segments"):
        catenary_chain(5, 0.1)
    with pytest.raises(ValueError, match="take more segments"):
        lay_u(make_boom(segment_count=8), (0.0, 0.0), 0.0, 0.1, water_level=0.0)


def test_tow_line_spans_its_two_points():
    start, end = np.array([1.0, 2.0, 0.7]), np.array([0.2, 1.5, 0.4])
    bodies, joints = tow_line("port", "tug", start, "boom/segment-00", end, mass_per_meter=0.1, diameter=0.02)
    (line,) = bodies
    length = np.linalg.norm(end - start)
    assert line.mass_properties.mass == pytest.approx(0.1 * length)
    tips = world_points(line, np.array([[-0.5 * length, 0.0, 0.0], [0.5 * length, 0.0, 0.0]]))
    assert tips == pytest.approx(np.array([start, end]), abs=1e-9)
    assert [(j.body_a, j.body_b) for j in joints] == [("tug", "port/line"), ("port/line", "boom/segment-00")]


def test_boom_made_fast_without_a_line():
    point = np.array([1.0, 2.0, 0.3])
    bodies, joints = tow_line("port", "tug", point, "boom/segment-00", point, mass_per_meter=0.1, diameter=0.02)
    assert bodies == () and len(joints) == 1 and joints[0].point == pytest.approx(point)


@pytest.mark.parametrize(("across", "along"), [(0.3, 0.0), (0.3, 0.4), (0.2, -0.6), (0.35, 0.9), (0.05, 0.99)])
def test_chain_in_a_stream_is_a_catenary_between_its_ends(across: float, along: float) -> None:
    """L^2 - along^2 = (2 a sinh(across / (2 a)))^2 gives the parameter of the catenary; slopes along the chain give it, too."""
    count = 400
    chain = stream_chain(count, across, along)
    assert chain[-1] == pytest.approx([across, along], abs=2e-4)
    links = np.diff(chain, axis=0) * count
    assert np.linalg.norm(links, axis=1) == pytest.approx(1.0)
    slope = -links[:, 1] / links[:, 0]
    measured = 1.0 / count / np.diff(slope).mean()
    low, high = across / 1400.0, 1e3  # the span 2 a sinh(across / (2 a)) falls with a
    for _ in range(200):
        middle = math.sqrt(low * high)
        wide = (2.0 * middle * math.sinh(across / (2.0 * middle))) ** 2 > 1.0 - along**2
        low, high = (middle, high) if wide else (low, middle)
    assert measured == pytest.approx(low, rel=5e-3)


def test_chain_in_a_stream_between_ends_abreast_is_that_of_a_sweep() -> None:
    assert stream_chain(20, 0.3, 0.0) - [0.15, 0.0] == pytest.approx(catenary_chain(20, 0.3) * [1.0, -1.0], abs=1e-6)
    for across, along in ((0.0, 0.5), (0.8, 0.7)):
        with pytest.raises(ValueError, match=r"across the stream|less than its length, in a stream"):
            stream_chain(20, across, along)
