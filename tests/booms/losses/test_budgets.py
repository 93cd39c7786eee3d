"""Budgets of closures: no oil counts twice, and whole particles add up to the closures' loss on the average."""

import numpy as np
import pytest

from booms.losses.closure_losses import WINDOW, LossBudgets
from booms.losses.rates import OVER_TOP, WAYS
from oilsim.oil.fates import LossCause

VOLUME = 1e-3
UNDER = 0


def owing(segments=1, seed=0):
    return LossBudgets(segments, VOLUME, seed)


def losses(cause, volume, segments=1):
    found = np.zeros((len(LossCause), segments))
    found[cause] = volume
    return found


def paid(budgets, segments):
    """Pay everything that is due, and count the particles."""
    count = 0
    for segment in range(segments):
        for way in range(len(WAYS)):
            while (cause := budgets.due(segment, way)) is not None:
                budgets.pay(segment, way, cause)
                count += 1
    return count


def test_whole_particles_add_up_to_the_loss_of_all_segments_from_the_beginning():
    segments, each = 4000, 0.3 * VOLUME
    budgets = owing(segments)
    budgets.add(losses(LossCause.ENTRAINMENT, each, segments), np.zeros((len(LossCause), segments)), 0.1)
    count = paid(budgets, segments)
    assert count == pytest.approx(0.3 * segments, abs=4.0 * np.sqrt(segments * 0.3 * 0.7))
    for _ in range(9):
        budgets.add(losses(LossCause.ENTRAINMENT, each, segments), np.zeros((len(LossCause), segments)), 0.1)
        count += paid(budgets, segments)
    assert count == 3 * segments  # ten times 0.3 of a particle, whatever each began with


def test_what_the_particles_lost_there_is_not_lost_again():
    budgets = owing()
    start = budgets.owed.copy()
    budgets.add(losses(LossCause.ENTRAINMENT, 2.0 * VOLUME), losses(LossCause.DRAINAGE, 2.0 * VOLUME), 0.1)
    assert paid(budgets, 1) == 0  # by another cause, but on the same way
    assert budgets.owed == pytest.approx(start)
    budgets.add(losses(LossCause.ENTRAINMENT, 2.0 * VOLUME), losses(LossCause.SPLASH_OVER, 2.0 * VOLUME), 0.1)
    assert paid(budgets, 1) == 2  # on another way


def test_a_burst_of_resolved_loss_counts_for_its_window_only():
    soon, late = owing(), owing()
    for budgets, pause in ((soon, 0.1), (late, 10.0 * WINDOW)):
        budgets.add(np.zeros((len(LossCause), 1)), losses(LossCause.DRAINAGE, 5.0 * VOLUME), 0.1)
        budgets.add(losses(LossCause.DRAINAGE, 2.5 * VOLUME), np.zeros((len(LossCause), 1)), pause)
    assert (paid(soon, 1), paid(late, 1)) == (0, 2)


def test_the_cause_with_the_largest_claim_is_lost_first():
    budgets = owing()
    budgets.add(
        losses(LossCause.ENTRAINMENT, 1.4 * VOLUME) + losses(LossCause.DRAINAGE, 0.8 * VOLUME),
        np.zeros((len(LossCause), 1)),
        0.1,
    )
    found = []
    while (cause := budgets.due(0, UNDER)) is not None:
        budgets.pay(0, UNDER, cause)
        found.append(cause)
    assert found[:2] == [LossCause.ENTRAINMENT, LossCause.DRAINAGE]
    assert budgets.due(0, WAYS.index(OVER_TOP)) is None


def test_budgets_go_on_from_a_saved_state():
    first, second = owing(3, seed=1), owing(3, seed=2)
    first.add(losses(LossCause.DRAINAGE, 0.7 * VOLUME, 3), np.zeros((len(LossCause), 3)), 0.1)
    second.restore_state(first.save_state())
    for budgets in (first, second):
        budgets.add(losses(LossCause.ENTRAINMENT, 0.9 * VOLUME, 3), np.zeros((len(LossCause), 3)), 0.1)
    assert paid(first, 3) == paid(second, 3)
    assert np.array_equal(first.owed, second.owed)


def test_what_particles_paid_gives_no_later_loss_its_cause():
    """Drainage that particles carried out by themselves is settled: what entrainment owes afterwards is named entrainment."""
    budgets = owing()
    budgets.add(losses(LossCause.DRAINAGE, 10.0 * VOLUME), losses(LossCause.DRAINAGE, 10.0 * VOLUME), 0.1)
    budgets.add(losses(LossCause.ENTRAINMENT, 20.0 * VOLUME), losses(LossCause.ENTRAINMENT, 0.0), 0.1)
    named = []
    while (cause := budgets.due(0, UNDER)) is not None:
        budgets.pay(0, UNDER, cause)
        named.append(cause)
    assert set(named) == {LossCause.ENTRAINMENT}
    assert len(named) == 20
