"""Oil is counted once where booms stand one behind the other or one within the other, whatever became of it."""

import numpy as np
import pytest

from booms.boom import Boom
from booms.boom_state import BoomState
from booms.containment import Containment, ContainmentOptions, fates_of, particle_rows
from oilsim.oil.fates import FATES
from tests.booms.laid import lay_u

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
        self.trackers = [Containment(options) for _ in booms]
        self.time, self.seen = 0.0, 0

    def tell(self, **places):
        """Particles by id, as p0, p1 ...; returns the rows of the ledger."""
        there = {int(name[1:]): place for name, place in places.items() if place is not None}
        ids = np.array(sorted(there), dtype=np.uint32)
        points = np.array([there[one] for one in ids.tolist()], dtype=float).reshape(-1, 3)
        for boom, tracker in zip(self.booms, self.trackers, strict=True):
            tracker.update(self.time, boom, points, ids, water_level=WATER)
        self.time += 1.0
        self.ids, self.seen = ids, max(self.seen, len(ids))
        rows = particle_rows(self.trackers, ids, 1.0, spilled=float(self.seen), left=self.seen - len(ids))
        assert rows.residual == 0.0
        return rows

    @property
    def fates(self):
        """Fates of the particles in the water, in words."""
        return [FATES[code] for code in fates_of(self.trackers, self.ids).fate]


def past(apex, height):
    """Places on the way out through a boom's apex, along -x."""
    return [(apex - step, 0.0, height) for step in (-0.2, -0.03, 0.03, 0.2)]


def test_oil_lost_by_one_boom_after_another_is_lost_once_by_the_last_cause():
    account = Account(FIRST, SECOND)
    for place in [*past(FIRST[1], FOOT), *past(SECOND[1], TOP)]:
        found = account.tell(p0=place)
        assert found.contained + found.afloat + found.all_lost == 1.0
    assert [len(tracker.standing().lost_at) for tracker in account.trackers] == [1, 1]
    assert np.isfinite([tracker.standing().lost_at[0] for tracker in account.trackers]).all()  # both have lost it
    assert found.lost["splash_over"] == found.all_lost == 1.0 and not any(found.lost_modelled.values())
    assert account.fates == ["lost_splash_over"]


def test_oil_lost_by_one_boom_and_held_by_the_next_is_held():
    account = Account(FIRST, SECOND)
    for place in [*past(FIRST[1], FOOT), past(SECOND[1], FOOT)[0]]:
        found = account.tell(p0=place)
    assert (found.contained, found.all_lost) == (1.0, 0.0)
    assert account.fates == ["contained"]


def test_oil_within_two_booms_is_held_once_and_lost_when_the_outer_one_loses_it():
    account = Account(FIRST, AROUND)
    assert account.tell(p0=past(FIRST[1], FOOT)[0]).contained == 1.0
    for place in past(FIRST[1], FOOT):
        found = account.tell(p0=place)
    assert found.contained == 1.0 and not found.all_lost  # out of the inner one, within the outer one
    for place in past(AROUND[1], TOP):
        found = account.tell(p0=place)
    assert found.lost["splash_over"] == found.all_lost == 1.0


@pytest.mark.parametrize("booms", [(FIRST,), (FIRST, SECOND)])
def test_what_has_left_the_water_is_lost_once_or_not_at_all(booms):
    """Particle 0 is lost and then gone, 1 is lost, 2 is held and then gone, 3 is free, 4 free and then gone."""
    account = Account(*booms)
    free, held = (9.0, 9.0, WATER), past(FIRST[1], FOOT)[0]
    for place in past(FIRST[1], FOOT):
        account.tell(p0=place, p1=place, p2=held, p3=free, p4=free)
    found = account.tell(p1=past(FIRST[1], FOOT)[-1], p3=free)
    assert (found.contained, found.afloat, found.left_the_domain) == (0.0, 1.0, 2.0)
    assert found.lost["drainage"] == found.all_lost == 2.0


def test_restored_accounts_know_which_boom_lost_last():
    account, other = Account(FIRST, SECOND), Account(FIRST, SECOND)
    for place in [*past(FIRST[1], FOOT), *past(SECOND[1], TOP)]:
        account.tell(p0=place)
    for tracker, copy in zip(account.trackers, other.trackers, strict=True):
        copy.restore_state(tracker.save_state())
    assert fates_of(other.trackers, account.ids).fate.tolist() == fates_of(account.trackers, account.ids).fate.tolist()
    assert account.fates == ["lost_splash_over"]
