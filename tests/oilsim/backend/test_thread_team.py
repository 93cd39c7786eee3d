"""Threads share kernels without a mistake: busy or asleep, many or few, and when a kernel fails."""

from __future__ import annotations

import gc
import os
import threading
import time

import numpy as np
import pytest
from numba import njit

from oilsim.backend.thread_team import BLOCK, Team

COUNT = 5 * BLOCK + 7


@njit(nogil=True)
def add_one(begin, end, values):
    for i in range(begin, end):
        values[i] += 1


def refuse_the_last(begin, end, last):
    if end == last:
        raise ValueError(f"no {last}")


@pytest.fixture(params=[1, 2, 3, 8])
def team(request):
    made = Team(request.param)
    yield made
    made.close()


def test_every_row_is_worked_on_once_a_run(team):
    values = np.zeros(COUNT, np.int64)
    for _ in range(2000):
        team.run(add_one, COUNT, values)
    assert (values == 2000).all()


def test_kernels_follow_each_other_in_order(team):
    # a member that still worked on the last kernel, or was given it twice, would add to the doubled values
    values, expected = np.ones(COUNT, np.int64), 1

    @njit(nogil=True)
    def double(begin, end, values):
        for i in range(begin, end):
            values[i] *= 2

    for step in range(300):
        kernel = (add_one, double)[step % 2] if step < 100 else add_one
        team.run(kernel, COUNT, values)
        expected = expected + 1 if kernel is add_one else 2 * expected
    assert (values == expected).all()


def test_members_that_fell_asleep_are_woken(team):
    values = np.zeros(COUNT, np.int64)
    for _ in range(5):
        team.run(add_one, COUNT, values)
        time.sleep(0.1)
    assert (values == 5).all()


def test_what_fails_in_any_member_is_raised_and_the_team_goes_on(team):
    values = np.zeros(COUNT, np.int64)
    for _ in range(3):
        with pytest.raises(ValueError, match=f"no {COUNT}"):
            team.run(refuse_the_last, COUNT, COUNT)
        team.run(add_one, COUNT, values)
    assert (values == 3).all()


def test_small_work_is_not_shared(team):
    cuts = []

    def note(begin, end):
        cuts.append((begin, end))

    team.run(note, BLOCK)
    assert cuts == [(0, BLOCK)]


def test_no_threads_are_refused():
    with pytest.raises(ValueError, match="threads is 0"):
        Team(0)


def test_threads_end_with_a_team_that_nobody_closed():
    others, values = set(threading.enumerate()), np.zeros(COUNT, np.int64)
    teams = [Team(3) for _ in range(5)]
    threads = set(threading.enumerate()) - others
    assert len(threads) == 10
    while teams:
        teams.pop().run(add_one, COUNT, values)
    gc.collect()
    patience = time.monotonic() + 10.0
    while any(thread.is_alive() for thread in threads) and time.monotonic() < patience:
        time.sleep(0.01)
    assert not any(thread.is_alive() for thread in threads)
    assert (values == 5).all()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
def test_the_child_of_a_fork_works_alone():
    team, values = Team(2), np.zeros(COUNT, np.int64)
    team.run(add_one, COUNT, values)
    child = os.fork()
    if child == 0:
        team.run(add_one, COUNT, values)
        os._exit(0 if team.threads == 1 and (values == 2).all() else 1)
    patience, ended = time.monotonic() + 20.0, (0, 0)
    while ended[0] == 0 and time.monotonic() < patience:
        time.sleep(0.01)
        ended = os.waitpid(child, os.WNOHANG)
    if ended[0] == 0:
        os.kill(child, 9)
    assert ended == (child, 0)
    team.run(add_one, COUNT, values)
    assert (values == 2).all()
    team.close()
