"""Plates thinner than particles: points that stand close enough, and their normals in corners and where a plate ends at another."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from coupling.solids.bodies import box
from coupling.solids.signed_distance import SignedDistance
from coupling.solids.surface_sampling import sample_surface
from coupling.solids.thin_parts import plate_normals
from oilsim.boundaries.plate_guard import BESIDE
from tests.oilsim.boundaries.test_thin_plates import cup, tray

SPACING = 0.1


@pytest.mark.parametrize("thickness", [0.1, 0.5, 1.0])
def test_points_leave_no_place_of_a_plate_without_one(thickness: float) -> None:
    dice, turn = np.random.default_rng(0), np.random.default_rng(1).uniform(0.0, 2.0 * np.pi, 20_000)
    height, breadth = dice.uniform(0.1, 1.0, 20_000), dice.uniform(-0.75, 0.75, 20_000)
    curved = np.column_stack([0.6 * np.cos(turn), 0.6 * np.sin(turn), height])
    flat = np.column_stack([0.0 * height, breadth, 2.0 * (height - 0.55)])
    for mesh, places in ((cup(thickness * SPACING), curved), (box((thickness * SPACING, 1.6, 2.4)), flat)):
        sampling = sample_surface(mesh, SPACING)
        assert sampling.plate_normal is not None
        standing = sampling.position[sampling.plate_normal.any(axis=1)]
        assert cKDTree(standing).query(places)[0].max() < BESIDE * SPACING


@pytest.mark.parametrize("thickness", [0.3, 1.0])
def test_points_where_plates_meet_have_normals_that_keep_liquid_on_both_sides(thickness: float) -> None:
    """Walls at x, y = +-0.6 m, a floor at z = 0 and a partition at x = 0; a corner has the mean normal, which points out of both plates."""
    along, up = np.linspace(-0.6, 0.6, 15), np.linspace(0.0, 1.1, 14)
    x, y = (each.ravel() for each in np.meshgrid(along, along))
    u, z = (each.ravel() for each in np.meshgrid(along, up))
    planes = [(x, y, 0.0 * x), (0.0 * u, u, z), *((side + 0.0 * u, u, z) for side in (-0.6, 0.6))]
    planes += [(u, side + 0.0 * u, z) for side in (-0.6, 0.6)]
    chosen = {
        (0.3, 0.2, 0.0): (0.0, 0.0, 1.0),  # floor
        (0.0, 0.2, 0.5): (1.0, 0.0, 0.0),  # partition
        (0.0, -0.541, 0.084): (1.0, 0.0, 0.0),  # partition, with wall and floor beside it
        (0.0, 0.2, 0.0): (1.0, 0.0, 0.0),  # foot of the partition
        (0.6, 0.2, 0.0): (1.0, 0.0, -1.0),  # wall and floor
        (0.6, 0.6, 0.5): (1.0, 1.0, 0.0),  # two walls
        (0.6, 0.6, 0.0): (1.0, 1.0, -1.0),  # two walls and the floor
    }
    points = np.concatenate([np.array(list(chosen)), *(np.column_stack(plane) for plane in planes)])
    normal = plate_normals(SignedDistance(tray(thickness * SPACING)), points, SPACING)
    for found, (place, wanted) in zip(normal, chosen.items(), strict=False):
        assert abs(found @ wanted) == pytest.approx(np.linalg.norm(wanted), rel=1e-6), place
