"""Rotations of many bodies against those of scipy, at random."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.multibody.rotations import applied, cross, in_world, places_of, turned
from oilsim.loads.body_axes import rotation_matrices

DICE = np.random.default_rng(5)
TURNS, OTHERS = (Rotation.random(20, random_state=seed) for seed in (1, 2))
VECTORS, MORE = DICE.normal(size=(2, 20, 3))
TENSORS = DICE.normal(size=(20, 3, 3))


def near(found: np.ndarray, expected: np.ndarray) -> None:
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-13)


def test_matrices_and_products_are_those_of_scipy() -> None:
    near(rotation_matrices(TURNS.as_quat()), TURNS.as_matrix())
    near(rotation_matrices(turned(TURNS.as_quat(), OTHERS.as_quat())), (TURNS * OTHERS).as_matrix())
    near(cross(VECTORS, MORE), np.cross(VECTORS, MORE))
    near(applied(TENSORS, VECTORS), np.einsum("nij,nj->ni", TENSORS, VECTORS))
    matrices = TURNS.as_matrix()
    near(in_world(TURNS.as_quat(), TENSORS), np.einsum("nij,njk,nlk->nil", matrices, TENSORS, matrices))


def test_points_of_bodies_turn_with_them_and_points_of_the_world_stay() -> None:
    rows = (*range(19), -1)
    place, arm = places_of(rows, VECTORS, np.hstack([MORE, TURNS.as_quat()]))
    near(arm[:19], TURNS[:19].apply(VECTORS[:19]))
    near(place[:19], MORE[:19] + TURNS[:19].apply(VECTORS[:19]))
    near(place[19], VECTORS[19])
