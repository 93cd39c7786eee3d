"""Which segment the water carries oil to, and how far the boom holds it up."""

import numpy as np
import pytest

from booms.losses.closure_losses import segments_ahead, standing_share

LINE = np.array([[2.0, 1.0], [0.0, 1.0], [0.0, 0.0], [0.0, -1.0], [2.0, -1.0]])  # a U that opens towards +x


def test_oil_goes_to_the_first_segment_down_the_stream():
    points = np.array([[1.0, 0.5], [1.9, -0.5], [0.5, 0.2], [-0.5, 0.2]])
    assert list(segments_ahead(points, LINE, np.array([-0.4, 0.0]))) == [1, 2, 1, 1]
    slanting = segments_ahead(np.array([[1.0, 0.5]]), LINE, np.array([-0.1, 0.4]))
    assert list(slanting) == [0]


def test_without_flow_oil_belongs_to_the_nearest_segment_within_its_length():
    points = np.array([[1.5, 0.8], [0.1, 0.5], [9.0, 0.0]])
    assert list(segments_ahead(points, LINE, np.zeros(2))) == [0, 1, -1]


def test_strips_take_all_the_oil_inside_once():
    random = np.random.default_rng(1)
    points = random.uniform([0.01, -0.99], [1.99, 0.99], (500, 2))
    found = segments_ahead(points, LINE, np.array([-0.3, 0.05]))
    assert (found >= 0).all()


def test_oil_that_drifts_with_the_water_is_not_held_up():
    normal = np.array([[-1.0, 0.0]])
    velocity = np.array([[0.0, 0.0], [-0.2, 0.3], [-0.4, 0.0], [-0.6, 0.0], [0.2, 0.0]])
    share = standing_share(velocity, np.zeros(5, np.int64), normal, np.zeros((1, 2)), np.array([0.4]))
    assert share == pytest.approx([1.0, 0.5, 0.0, 0.0, 1.0])
    towed = standing_share(
        np.array([[0.4, 0.0]]), np.zeros(1, np.int64), normal, np.array([[0.4, 0.0]]), np.array([0.4])
    )
    assert towed == pytest.approx([1.0])
