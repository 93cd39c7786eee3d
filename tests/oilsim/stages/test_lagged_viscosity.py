"""Viscosity that is lagged: each liquid's by itself, the same in the end as if every step had given it, and no momentum is lost by it."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import Phase, block
from oilsim.stages import viscosity as viscosity_stage
from oilsim.stages.viscosity import viscosity_due
from oilsim.viscosity.pair_stiffness import viscosity_matrix

SPACING, STEP = 1.0 / 24.0, 0.01
WATER, OIL = 1e-2, 100.0  # [Pa s]: in a step nu t / d^2 is 6e-5 and 0.6
LIQUIDS = tuple(
    Phase(name=name, rest_density=1000.0, dynamic_viscosity=mu) for name, mu in (("water", WATER), ("oil", OIL))
)


def sheared(make_fluid):
    """Oil above water, weightless and periodic, both sheared by a wave of the box's height."""
    fluid = make_fluid(
        particle_spacing=SPACING, phases=LIQUIDS, dimension=2, lower=(0, -0.5, 0), upper=(1, 0.5, 1), gravity=(0, 0, 0),
        periodic=(True, False, True), maximum_time_step=STEP,
    )  # fmt: skip
    for name, bottom in (("water", 0.0), ("oil", 0.5)):
        points = block((0, 0, bottom), (1, 0, bottom + 0.5), SPACING, 2)
        speed = np.sin(2.0 * np.pi * points[:, 2])
        fluid.add_particles(points, phase=name, velocity=speed[:, None] * [0.1, 0.0, 0.0])
    return fluid


def test_thin_liquid_beside_a_thick_one_waits_for_its_own_time(make_fluid):
    fluid, waited = sheared(make_fluid), []
    for _ in range(20):
        fluid.advance(STEP)
        waited.append(fluid.state.viscous_time.copy())
    water, oil = np.array(waited).T
    assert not oil.any()
    assert water.max() == pytest.approx(0.17, abs=0.02)  # 1e-3 d^2 / nu
    assert (water == 0.0).sum() == 1


def test_what_is_owed_comes_to_the_same_and_loses_no_momentum(make_fluid, monkeypatch):
    flows = []
    for least in (viscosity_stage.NEGLIGIBLE, 0.0):
        monkeypatch.setattr(viscosity_stage, "NEGLIGIBLE", least)
        fluid = sheared(make_fluid)
        before = fluid.momentum()
        fluid.advance(50 * STEP)
        np.testing.assert_allclose(fluid.momentum(), before, atol=1e-5 * 1000.0 * 0.1)
        flows.append([np.abs(fluid.phase_velocities(name)[:, 0]).mean() for name in ("water", "oil")])
    lagged, given = np.array(flows)
    assert given[0] > 0.05  # the oil has come to rest, and the water flows on below it
    np.testing.assert_allclose(lagged, given, atol=0.01 * 0.1)


def test_shear_of_two_liquids_goes_with_the_thinner_one():
    viscosity = np.array([1.0, 30.0, 1.0, 0.0])
    lagged, inertia = np.array([4.0, 2.0, 4.0, 0.0]), np.array([1.0, 1.0, 100.0, 1.0])
    matrix = viscosity_matrix(viscosity.tolist(), same_phase_only=False)
    due = viscosity_due(lagged, viscosity, matrix, inertia, least=1.0)
    assert (due.span, due.number, due.lagged.tolist()) == (4.0, 60.0, [0.0, 0.0, 4.0, 0.0])
    np.testing.assert_array_equal(due.matrix, due.matrix.T)
    np.testing.assert_array_equal(due.matrix[1], [matrix[0, 1], 15.0, 0.0, 0.0])
    assert viscosity_due(0.1 * lagged, viscosity, matrix, 100.0 * inertia, least=1.0).span == 0.0
    all_due = viscosity_due(lagged, viscosity, matrix, inertia, least=0.0)
    assert all_due.lagged.tolist() == [0.0] * 4
