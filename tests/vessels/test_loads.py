"""A hull loaded strip by strip: draft, trim and stability of the whole mesh, and the period of heave and roll."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from oilsim.loads.load_model import heave_added_mass, sway_added_mass
from oilsim.loads.morison import FloatingBodies
from tests.seas import steady_sea
from vessels.hull import float_hull, raked_barge, wigley_hull
from vessels.loads import hull_loads, ittc_friction

RHO = 1027.0


def pose_of(hull, turn=(0, 0, 0), height=0.0):
    return np.array([[0, 0, height - hull.waterline, *Rotation.from_rotvec(turn).as_quat()]])


def _longitudinal_height(hull) -> float:
    """GM = I_pitch / V + z_B - z_G [m], with the centre of mass at 0."""
    return (
        hull.hydrostatics.pitch_second_moment / hull.hydrostatics.displaced_volume
        + hull.hydrostatics.center_of_buoyancy[2]
    )


@pytest.mark.parametrize("mesh", [wigley_hull(15.0, 5.0, 1.8, 3.0), raked_barge(15.0, 5.0, 1.5, 2.5, rake=2.0)])
def test_hull_floats_upright_at_its_draft_and_rights_itself_by_its_metacentric_height(mesh):
    hull = float_hull(mesh, 1.8 if mesh.extents[2] == pytest.approx(3.0) else 1.5, water_density=1027.0)
    bodies = FloatingBodies([hull_loads(hull)], steady_sea(density=RHO))
    weight = hull.mass_properties.mass * 9.81
    still = bodies.loads(0.0, pose_of(hull), np.zeros((1, 6))).wrench[0]
    assert still[2] == pytest.approx(weight, rel=1e-6)
    assert np.abs(still[[0, 1, 3, 4, 5]]).max() < 1e-6 * weight * hull.length
    heel = 1e-3
    rolled = bodies.loads(0.0, pose_of(hull, (heel, 0, 0)), np.zeros((1, 6))).wrench[0, 3]
    pitched = bodies.loads(0.0, pose_of(hull, (0, heel, 0)), np.zeros((1, 6))).wrench[0, 4]
    assert rolled == pytest.approx(-weight * hull.hydrostatics.metacentric_height(0.0) * heel, rel=0.01)
    assert pitched == pytest.approx(-weight * _longitudinal_height(hull) * heel, rel=0.01)


def test_barge_carries_the_added_mass_of_its_sections():
    """A box barge: heave rho pi / 8 B^2 L, sway rho pi / 2 T^2 L; ITTC friction of the wetted area along it."""
    hull = float_hull(raked_barge(15.0, 5.0, 1.5, 2.5), 1.5, water_density=1027.0)
    bodies = FloatingBodies([hull_loads(hull)], steady_sea(density=RHO, current=(1.0, 0.0)))
    found = bodies.loads(0.0, pose_of(hull), np.zeros((1, 6)))
    mass = found.added_mass[0]
    assert mass[2, 2] == pytest.approx(heave_added_mass(1027.0, 5.0) * 15.0, rel=1e-6)
    assert mass[1, 1] == pytest.approx(sway_added_mass(1027.0, 1.5) * 15.0, rel=1e-6)
    wetted = 15.0 * 5.0 + 2 * 1.5 * (15.0 + 5.0)
    assert ittc_friction(1.0, 15.0) == pytest.approx(0.075 / (math.log10(15.0 / 1.19e-6) - 2) ** 2)
    assert found.wrench[0, 0] == pytest.approx(0.5 * 1027.0 * 1.2 * ittc_friction(1.0, 15.0) * wetted, rel=1e-6)
