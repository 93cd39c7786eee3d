"""Spreading points: the push between neighbours by its formula, and a choice that keeps its distance and leaves no room."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

from coupling.solids.even_points import choose_apart, push_apart, random_distance

DISTANCE = 0.2


@pytest.mark.parametrize("share", [0.3, 1.0, 1.4, 1.5, 2.0])
def test_two_points_push_each_other_by_the_formula(share: float) -> None:
    away = np.array([2.0, -1.0, 2.0]) / 3.0
    points = np.array([[0.3, 0.1, -0.2], [0.3, 0.1, -0.2] + share * DISTANCE * away])
    push = 0.15 * DISTANCE * max(0.0, 1.0 - share / 1.5) ** 2
    assert push_apart(points, DISTANCE) == pytest.approx(np.array([-push * away, push * away]), abs=1e-15)


def test_pushes_of_many_points_have_no_sum_and_add_up_over_pairs() -> None:
    points = np.random.default_rng(2).uniform(0.0, 1.0, (60, 3))
    wanted = np.zeros_like(points)
    for i in range(len(points)):
        for j in range(len(points)):
            gap = np.linalg.norm(points[i] - points[j])
            if i != j and gap < 0.3:
                wanted[i] += 0.15 * DISTANCE * (1.0 - gap / 0.3) ** 2 * (points[i] - points[j]) / gap
    moves = push_apart(points, DISTANCE)
    assert np.abs(wanted).max() > 0.01 * DISTANCE
    assert moves == pytest.approx(wanted, abs=1e-14)
    assert moves.sum(axis=0) == pytest.approx([0.0, 0.0, 0.0], abs=1e-14)


def test_points_in_one_place_stay_there() -> None:
    assert not push_apart(np.zeros((3, 3)), DISTANCE).any()


def test_choice_keeps_its_distance_and_leaves_no_room() -> None:
    candidates = np.random.default_rng(3).uniform(0.0, 1.0, (3000, 3))
    chosen = candidates[choose_apart(candidates, DISTANCE)]
    assert len(cKDTree(chosen).query_pairs(0.999999 * DISTANCE)) == 0
    assert cKDTree(chosen).query(candidates)[0].max() <= DISTANCE


def test_the_first_candidates_are_asked_first_and_in_their_order() -> None:
    candidates = np.array([[0.15, 0.0, 0.0], [0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.45, 0.0, 0.0]])
    assert choose_apart(candidates, DISTANCE, ordered=4).tolist() == [0, 3]
    assert choose_apart(np.zeros((0, 3)), DISTANCE).tolist() == []


def test_random_choice_covers_what_random_sequential_adsorption_covers() -> None:
    """Discs of the least distance across, one per pitch^2, cover 0.547 of a plane (Feder 1980; Hinrichsen et al. 1986)."""
    pitch = 0.05
    assert math.pi / 4.0 * random_distance(pitch) ** 2 == pytest.approx(0.547 * pitch**2, rel=0.01)
