"""Oil is counted once where booms stand one behind the other or one within the other, whatever became of it."""

import numpy as np
import pytest

from booms.balance import OilBalance, balance, lost_ids
from booms.boom import Boom
from booms.boom_state import BoomState
from booms.containment import ContainmentOptions, ContainmentTracker
from booms.deployment import lay_u

WATER, NEAR, ASTERN = 0.5, 0.5, 6.0  # the second boom lies this far behind the first along -x: about it, or free of it
FOOT, TOP = WATER - 0.25, WATER + 0.14  # heights that mean drainage and splash-over


def laid(behind, length=6.0):
    boom = Boom(
        length=length,
        segment_count=24,
        skirt_depth=0.2,
        freeboard=0.1,
        float_width=0.08,
        float_draft=0.03,
        skirt_thickness=0.06,
        design_skirt_thickness=0.005,
    )
    layout = lay_u(boom, (-behind, 0.0), 0.0, 0.35, water_level=WATER)
    state = BoomState(
        position=np.array([body.position for body in layout.segments]),
        orientation=np.array([body.orientation for body in layout.segments]),
        velocity=np.zeros((24, 3)),
        joint_points=layout.segment.joint_points,
        waterline=layout.segment.waterline,
    )
    return state, min(float(joint.point[0]) for joint in layout.joints)


FIRST, SECOND, AROUND = laid(0.0), laid(ASTERN), laid(NEAR, length=9.0)


class Account:
    """Two booms' trackers, told of particles at one place after another; None: gone from the water."""

    def __init__(self, *booms):
        self.booms = [state for state, _ in booms]
        options = ContainmentOptions(skirt_depth=0.2, freeboard=0.1, particle_volume=1.0, hysteresis=0.05)
        self.trackers = [ContainmentTracker(options) for _ in booms]
        self.time = 0.0

    def tell(self, **places):
        """Particles by id, as p0, p1 ...; returns the balance."""
        there = {int(name[1:]): place for name, place in places.items() if place is not None}
        ids = np.array(sorted(there), dtype=np.uint32)
        points = np.array([there[one] for one in ids.tolist()], dtype=float).reshape(-1, 3)
        for boom, tracker in zip(self.booms, self.trackers, strict=True):
            tracker.update(self.time, boom, points, ids, water_level=WATER)
        self.time += 1.0
        return balance(self.trackers, ids)


def past(apex, height):
    """Places on the way out through a boom's apex, along -x."""
    return [(apex - step, 0.0, height) for step in (-0.2, -0.03, 0.03, 0.2)]


def test_oil_lost_by_one_boom_after_another_is_lost_once_by_the_last_cause():
    account = Account(FIRST, SECOND)
    for place in [*past(FIRST[1], FOOT), *past(SECOND[1], TOP)]:
        found = account.tell(p0=place)
        assert found.retained + found.free + sum(found.lost_by_cause.values()) == 1
    assert [len(tracker.standing().lost_at) for tracker in account.trackers] == [1, 1]
    assert np.isfinite([tracker.standing().lost_at[0] for tracker in account.trackers]).all()  # both have lost it
    assert found == OilBalance(retained=0, free=0, lost_by_cause={"splash_over": 1}, lost_modelled={}, lost_and_gone=0)
    assert lost_ids(account.trackers) == {"splash_over": np.array([0], np.uint32)}


def test_oil_lost_by_one_boom_and_held_by_the_next_is_held():
    account = Account(FIRST, SECOND)
    for place in [*past(FIRST[1], FOOT), past(SECOND[1], FOOT)[0]]:
        found = account.tell(p0=place)
    assert found == OilBalance(retained=1, free=0, lost_by_cause={}, lost_modelled={}, lost_and_gone=0)
    assert lost_ids(account.trackers) == {}


def test_oil_within_two_booms_is_held_once_and_lost_when_the_outer_one_loses_it():
    account = Account(FIRST, AROUND)
    assert account.tell(p0=past(FIRST[1], FOOT)[0]).retained == 1
    for place in past(FIRST[1], FOOT):
        found = account.tell(p0=place)
    assert found.retained == 1 and not found.lost_by_cause  # out of the inner one, within the outer one
    for place in past(AROUND[1], TOP):
        found = account.tell(p0=place)
    assert found == OilBalance(retained=0, free=0, lost_by_cause={"splash_over": 1}, lost_modelled={}, lost_and_gone=0)


@pytest.mark.parametrize("booms", [(FIRST,), (FIRST, SECOND)])
def test_what_has_left_the_water_is_lost_once_or_not_at_all(booms):
    """Particle 0 is lost and then gone, 1 is lost, 2 is held and then gone, 3 is free, 4 free and then gone."""
    account = Account(*booms)
    free, held = (9.0, 9.0, WATER), past(FIRST[1], FOOT)[0]
    for place in past(FIRST[1], FOOT):
        account.tell(p0=place, p1=place, p2=held, p3=free, p4=free)
    found = account.tell(p1=past(FIRST[1], FOOT)[-1], p3=free)
    assert found == OilBalance(retained=0, free=1, lost_by_cause={"drainage": 2}, lost_modelled={}, lost_and_gone=1)


def test_restored_accounts_know_which_boom_lost_last():
    account, other = Account(FIRST, SECOND), Account(FIRST, SECOND)
    for place in [*past(FIRST[1], FOOT), *past(SECOND[1], TOP)]:
        account.tell(p0=place)
    for tracker, copy in zip(account.trackers, other.trackers, strict=True):
        copy.restore_state(tracker.save_state())
    assert lost_ids(other.trackers) == lost_ids(account.trackers)
