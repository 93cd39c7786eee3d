"""The oil account: inside and outside, every cause once, hysteresis, recovery, the boom's own figures."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from booms.boom import Boom
from booms.boom_state import BoomState, beside, signed_distance
from booms.containment import Containment, ContainmentOptions, fates_of
from oilsim.oil.fates import LossCause
from tests.booms.laid import lay_u

WATER = 0.5
BOOM = Boom(
    length=6.0,
    segment_count=24,
    skirt_depth=0.2,
    freeboard=0.1,
    float_width=0.08,
    float_draft=0.03,
    skirt_thickness=0.06,
    design_skirt_thickness=0.005,
)
LAYOUT = lay_u(BOOM, (0.0, 0.0), 0.0, 0.35, water_level=WATER)
APEX = min(float(joint.point[0]) for joint in LAYOUT.joints)
VOLUME = 0.04**3


def boom_state(velocity=(0.0, 0.0, 0.0), sink=0.0, heel=0.0):
    orientation = np.array([body.orientation for body in LAYOUT.segments])
    orientation = (Rotation.from_quat(orientation) * Rotation.from_rotvec([heel, 0.0, 0.0])).as_quat()
    return BoomState(
        position=np.array([body.position for body in LAYOUT.segments]) - [0.0, 0.0, sink],
        orientation=orientation,
        velocity=np.tile(velocity, (len(LAYOUT.segments), 1)),
        joint_points=LAYOUT.segment.joint_points,
        waterline=LAYOUT.segment.waterline,
    )


def make_tracker(**changes):
    options = {"skirt_depth": 0.2, "freeboard": 0.1, "particle_volume": VOLUME, "hysteresis": 0.05}
    return Containment(ContainmentOptions(**(options | changes)))


def follow(tracker, path, boom=None, pool=()):
    """Report after one particle went along `path`, with a resting pool of others."""
    others = np.array(pool).reshape(-1, 3)
    for time, point in enumerate(path):
        points = np.concatenate([[point], others])
        report = tracker.update(float(time), boom or boom_state(), points, np.arange(len(points)), water_level=WATER)
    return report


def test_signed_distance_to_a_square_without_its_last_side():
    line = np.array([[0.0, 1.0], [0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    points = np.array([[0.5, 0.3], [0.1, 0.5], [0.5, 0.9], [0.5, 1.2], [-0.3, -0.4], [1.0, 2.0]])
    distance, edge = signed_distance(points, line)
    assert distance == pytest.approx([0.3, 0.1, 0.1, -0.2, -0.5, -1.0])
    assert list(edge) == [1, 0, 3, 3, 1, 3]  # the last edge, 3, is the gap; it wins the corner at (1, 1)


def test_area_inside_the_u_by_counting_points():
    random = np.random.default_rng(3)
    line = boom_state().line()
    low, high = line.min(axis=0), line.max(axis=0)
    points = random.uniform(low, high, (50_000, 2))
    share = float((signed_distance(points, line)[0] > 0.0).mean())
    x, y = line.T
    area = 0.5 * abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))  # shoelace formula
    expected = area / float(np.prod(high - low))
    assert share == pytest.approx(expected, abs=4.0 * math.sqrt(expected * (1 - expected) / 50_000))


def test_line_goes_through_ends_and_joints():
    line = boom_state().line()
    expected = [LAYOUT.end_points[0], *(joint.point for joint in LAYOUT.joints), LAYOUT.end_points[1]]
    assert line == pytest.approx(np.array(expected)[:, :2], abs=1e-9)
    assert boom_state().gap_ratio == pytest.approx(0.35, rel=1e-9)


def test_normal_speed_is_that_across_the_segment():
    state = boom_state(velocity=(0.4, 0.0, 0.0))
    along = np.diff(state.line(), axis=0) / BOOM.segment_length
    assert state.normal_speed(np.zeros(2)) == pytest.approx(0.4 * np.abs(along[:, 1]))
    # a boom held still in the same stream feels the same; one that drifts with it feels nothing
    assert boom_state().normal_speed(np.array([-0.4, 0.0])) == pytest.approx(0.4 * np.abs(along[:, 1]))
    assert state.normal_speed(np.array([0.4, 0.0])) == pytest.approx(0.0)
    assert (state.normal() @ [1.0, 0.0])[11] < -0.9  # at the apex the normal points astern, out of the U


@pytest.mark.parametrize(
    ("through", "boom", "options", "cause"),
    [
        ((APEX, 0.0, WATER - 0.25), {"velocity": (0.5, 0, 0)}, {}, LossCause.ENTRAINMENT),
        ((APEX, 0.0, WATER - 0.25), {"velocity": (0.2, 0, 0)}, {}, LossCause.DRAINAGE),
        ((APEX, 0.0, WATER - 0.25), {"velocity": (0.2, 0, 0)}, {"entrainment_speed": 0.15}, LossCause.ENTRAINMENT),
        ((APEX, 0.0, WATER - 0.25), {}, {"kinematic_viscosity": 4e-3}, LossCause.CRITICAL_ACCUMULATION),
        ((APEX, 0.0, WATER - 0.25), {"heel": math.radians(60)}, {}, LossCause.PLANING),
        ((APEX, 0.0, WATER + 0.02), {"sink": 0.15}, {}, LossCause.SUBMERGENCE),
        ((APEX, 0.0, WATER + 0.14), {}, {}, LossCause.SPLASH_OVER),
        ((APEX, 0.0, WATER - 0.05), {}, {}, LossCause.THROUGH),
        ((0.0, 0.3, WATER), {}, {}, LossCause.AROUND_ENDS),
    ],
)
def test_each_way_out_has_its_cause(through, boom, options, cause):
    outward = 1.0 if cause is LossCause.AROUND_ENDS else -1.0
    path = [np.add(through, (outward * step, 0.0, 0.0)) for step in (-0.2, -0.03, 0.03, 0.2)]
    report = follow(make_tracker(**options), path, boom_state(**boom))
    assert report.all_lost == pytest.approx(VOLUME)
    assert report.lost == {c.name.lower(): VOLUME if c is cause else 0.0 for c in LossCause}


def test_oil_down_to_the_foot_of_the_skirt_drains_even_when_towed_fast():
    pool = [(APEX + 0.1, 0.02 * (k % 3 - 1), WATER - 0.02 * k) for k in range(12)]  # reaches 0.22 m down
    path = [(APEX + step, 0.0, WATER - 0.25) for step in (0.2, 0.03, -0.03, -0.2)]
    report = follow(make_tracker(), path, boom_state(velocity=(0.5, 0, 0)), pool)
    assert report.lost["drainage"] == pytest.approx(VOLUME)
    assert report.contained == pytest.approx(12 * VOLUME)


def test_oil_at_the_line_is_not_counted_back_and_forth():
    tracker = make_tracker()
    wiggle = [(APEX + step, 0.0, WATER) for step in (0.3, -0.04, 0.04, -0.04, 0.04, -0.04)]
    report = follow(tracker, wiggle)
    assert (report.all_lost, report.recontained, report.contained) == (0.0, 0.0, pytest.approx(VOLUME))
    assert report.outside == pytest.approx(VOLUME)  # by plan view it is outside at this moment


def test_lost_oil_can_be_recontained_and_lost_again():
    tracker = make_tracker()
    under, over = WATER - 0.25, WATER + 0.14
    report = follow(tracker, [(APEX + 0.2, 0.0, under), (APEX - 0.2, 0.0, under)])
    assert (report.all_lost, report.recontained) == (pytest.approx(VOLUME), 0.0)
    report = follow(tracker, [(APEX - 0.02, 0.0, over), (APEX + 0.02, 0.0, over)])
    assert report.all_lost == pytest.approx(VOLUME)  # not yet far enough inside
    report = follow(tracker, [(APEX + 0.2, 0.0, over)])
    assert (report.all_lost, report.recontained, report.contained) == (
        0.0,
        pytest.approx(VOLUME),
        pytest.approx(VOLUME),
    )
    report = follow(tracker, [(APEX - 0.2, 0.0, over)])
    assert report.lost["splash_over"] == pytest.approx(VOLUME)
    assert report.all_lost == pytest.approx(VOLUME)  # one particle, counted once


def test_every_particle_is_in_one_account():
    tracker, random = make_tracker(), np.random.default_rng(5)
    points = random.uniform((-3.0, -2.0, WATER - 0.3), (1.0, 2.0, WATER + 0.2), (400, 3))
    ids = np.arange(400)
    for step in range(20):
        present = ids[step:]  # one particle leaves the water at every step
        report = tracker.update(float(step), boom_state(), points[present], present, water_level=WATER)
        gone = fates_of([tracker], present).gone_fate
        assert report.contained + report.afloat + report.all_lost == pytest.approx((len(present) + len(gone)) * VOLUME)
        assert report.inside + report.outside == pytest.approx(len(present) * VOLUME, rel=1e-9)
        points = points + random.normal(0.0, 0.08, points.shape)
    assert report.all_lost > 0.0 and report.contained > 0.0


def test_oil_outside_is_afloat_until_it_is_gathered():
    tracker = make_tracker()
    report = follow(tracker, [(0.5, 0.0, WATER)])
    assert (report.afloat, report.contained, report.all_lost) == (pytest.approx(VOLUME), 0.0, 0.0)
    assert follow(tracker, [(-0.5, 0.0, WATER)]).contained == pytest.approx(VOLUME)


def test_account_restored_goes_on_from_there():
    tracker = make_tracker()
    follow(tracker, [(APEX + 0.2, 0.0, WATER - 0.25)])
    saved = tracker.save_state()
    first = follow(tracker, [(APEX - 0.2, 0.0, WATER - 0.25)])
    tracker.restore_state(saved)
    assert follow(tracker, [(APEX - 0.2, 0.0, WATER - 0.25)]) == first
    assert first.all_lost > 0.0


def test_series_carry_the_account_by_name():
    series = follow(make_tracker(), [(-0.5, 0.0, WATER)]).series()
    assert series["oil_inside"] == series["oil_contained"] == pytest.approx(VOLUME)
    assert series["oil_lost/drainage"] == 0.0


def test_oil_that_a_closure_carries_out_is_lost_modelled_until_it_is_recontained():
    tracker = make_tracker()
    follow(tracker, [(APEX + 0.2, 0.0, WATER)])
    tracker.lose(1.0, 0, LossCause.ENTRAINMENT, 11)
    report = follow(tracker, [(APEX - 0.1, 0.0, WATER - 0.25)])
    assert report.all_lost == report.lost["entrainment"] == report.lost_modelled["entrainment"] == pytest.approx(VOLUME)
    standing = tracker.standing()
    assert (standing.modelled[0], standing.segment[0], standing.lost_at[0]) == (True, 11, 1.0)
    with pytest.raises(ValueError, match="particle 0 is not held"):
        tracker.lose(2.0, 0, LossCause.DRAINAGE, 3)
    back = follow(tracker, [(APEX + 0.2, 0.0, WATER)])
    assert (back.all_lost, back.recontained) == (0.0, pytest.approx(VOLUME))
    again = follow(
        tracker, [(APEX + 0.03, 0.0, WATER - 0.25), (APEX - 0.03, 0.0, WATER - 0.25), (APEX - 0.2, 0.0, WATER)]
    )
    assert again.all_lost == pytest.approx(VOLUME)
    assert not any(again.lost_modelled.values())  # this time the particles carried it out themselves


SEA = (4.0, 3.0)
"""Period [m] along x and y of a sea that is shorter than the boom's way and narrower than twice its mouth."""


def sailed_on(way: float) -> BoomState:
    """The boom, `way` m further along x."""
    state = boom_state()
    return BoomState(**(vars(state) | {"position": state.position + np.array([way, 0.0, 0.0])}))


def test_oil_stays_inside_when_the_boom_sails_on_across_periodic_sides():
    """The boom and the oil in it go 9 m through a sea of 4 m: bodies sail on, particles enter again at the opposite side."""
    held = np.array([(APEX + 0.4 + 0.1 * (k % 6), 0.1 * (k // 6) - 0.15, WATER) for k in range(24)])
    tracker = make_tracker(period=SEA)
    for way in np.arange(0.0, 9.0, 0.05):
        sailed, wrapped = sailed_on(way), held + np.array([way, 0.0, 0.0])
        wrapped[:, :2] %= SEA
        report = tracker.update(way, sailed, wrapped, np.arange(24), water_level=WATER)
        assert report.contained == report.inside == pytest.approx(24 * VOLUME)
    assert report.all_lost == report.recontained == 0.0


def test_oil_that_falls_astern_is_still_lost_in_a_periodic_sea():
    tracker = make_tracker(period=SEA)
    for step in range(10):
        sailed = sailed_on(0.1 * step)
        point = np.array([[(APEX + 0.3) % SEA[0], 0.1, WATER - 0.3]])
        report = tracker.update(float(step), sailed, point, np.arange(1), water_level=WATER)
    assert report.lost["drainage"] == pytest.approx(VOLUME)


def test_oil_that_comes_round_a_periodic_sea_has_passed_and_oil_that_comes_straight_back_has_not():
    """The particle goes under the apex, drifts on by a whole period, and comes in at the mouth; another one only peeps out."""
    low = WATER - 0.25
    under = [(APEX + x, 0.0, low) for x in (0.3, 0.05, -0.02, -0.2)]
    astern = [(APEX + x, 0.0, WATER) for x in (-0.5, -1.0, -1.5, -2.0)]
    ahead = [(APEX + SEA[0] + x, 0.0, WATER) for x in (-2.5, -3.0, -3.5, SEA[0] * -1.0 + 0.3)]
    round_the_sea = follow(make_tracker(period=SEA), under + astern + ahead)
    assert round_the_sea.contained == round_the_sea.returned == round_the_sea.passed == pytest.approx(VOLUME)
    assert round_the_sea.recontained == round_the_sea.all_lost == round_the_sea.passed_modelled == 0.0
    straight_back = follow(make_tracker(period=SEA), under + under[::-1])
    assert straight_back.recontained == pytest.approx(VOLUME)
    assert straight_back.passed == straight_back.returned == 0.0


@pytest.mark.parametrize("period", [(4.0, 3.0), (1.5, 0.0), (0.0, 0.7), (0.5, 0.6)])
def test_a_point_is_taken_at_its_deepest_image(period):
    """Against a search through all images in a wide frame, also for seas that are shorter than the boom."""
    random = np.random.default_rng(5)
    line = boom_state().line() + np.array([11.0, -7.0])
    points = (
        line.mean(axis=0) + random.uniform(-3.0, 3.0, (300, 2)) + np.array(period) * random.integers(-9, 9, (300, 2))
    )
    points = np.column_stack([points, np.zeros(300)])
    shifts = [
        (i * period[0], j * period[1])
        for i in range(-40, 41) if period[0] or i == 0
        for j in range(-40, 41) if period[1] or j == 0
    ]  # fmt: skip
    deepest = np.max([signed_distance(points[:, :2] + shift, line)[0] for shift in shifts], axis=0)
    found = signed_distance(beside(points, line, period)[:, :2], line)[0]
    near = deepest > -0.1 * min(length for length in period if length)
    assert near.sum() > 20
    assert found[near] == pytest.approx(deepest[near], abs=1e-9)
    assert ((found > 0.0) == (deepest > 0.0)).all()
