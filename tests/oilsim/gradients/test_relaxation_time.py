"""Without gravity the flow sets the unit of time: what moves twice as fast does the same in half the time, to the last bit."""

from __future__ import annotations

import math

import numpy as np
import pytest

from oilsim import block, sphere
from oilsim.gradients.relaxation_time import GRADIENT, LONGEST, froude_unit, passing_unit, shear_rate_sums
from tests.oilsim.conftest import disturbed

STEPS, STEP = 12, 0.02  # s, at a speed of 1 m/s; by 25 steps disorder has made ten times as much of a rounding
EPSILON = float(np.finfo(np.float32).eps)


def unit_of(gradients, largest=math.inf):
    """The unit [s] of particles with velocity gradients (N, 3, 3) [1/s]."""
    flow = np.zeros((len(gradients), 16), np.float32)
    flow[:, GRADIENT:].reshape(-1, 3, 4)[:, :, :3] = gradients
    sums = np.zeros((1, 2))
    shear_rate_sums(0, len(gradients), flow, np.float32(min(largest, 1e30)), sums)
    return passing_unit(*sums.sum(axis=0))


def shear(rate):
    """The gradient of v_x = rate z."""
    return rate * np.outer((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))


def test_layers_of_simple_shear_pass_each_other_in_the_unit():
    assert unit_of([shear(5.0)]) == pytest.approx(1.0 / 5.0, rel=4 * EPSILON)


def test_turning_as_one_adds_nothing():
    turn = np.cross(np.eye(3), (3.0, -20.0, 7.0))
    assert unit_of([shear(5.0) + turn]) == pytest.approx(1.0 / 5.0, rel=20 * EPSILON)
    assert unit_of([turn]) == LONGEST


def test_liquid_at_rest_has_no_say():
    assert unit_of([shear(5.0)] + 500 * [shear(0.0)]) == pytest.approx(1.0 / 5.0, rel=4 * EPSILON)


def test_unit_of_unequal_shear():
    # (1 + 4) / (1 + 8)
    assert unit_of([shear(1.0), shear(2.0)]) == pytest.approx(5.0 / 9.0, rel=4 * EPSILON)


def test_what_a_step_leaves_unresolved_counts_as_its_limit():
    calm = 500 * [shear(1.0)]
    assert unit_of([*calm, shear(1e6)], largest=4.0) == unit_of([*calm, shear(4.0)])


def test_unit_under_gravity_is_froudes(make_fluid):
    fluid = make_fluid(gravity=(3.0, 0.0, -4.0))
    assert froude_unit(0.1, (3.0, 0.0, -4.0)) == pytest.approx(math.sqrt(0.1 / 5.0))
    fluid.add_particles(block((0.5, 0.5, 0.5), (1.0, 1.0, 1.0), 0.1), phase="water", velocity=np.ones(3))
    fluid.advance(0.01)
    assert fluid.arrays.sums.time_unit == froude_unit(0.1, (3.0, 0.0, -4.0))


def vortices(make_fluid, speed, threads=1, spacing=0.1):
    """A periodic box of vortices of `speed` [m/s] on disordered particles; bounds of the step go with it."""
    fluid = make_fluid(
        threads, particle_spacing=spacing, dimension=2, periodic=(True, False, True), gravity=(0.0, 0.0, 0.0),
        maximum_time_step=STEP / speed, minimum_time_step=1e-4 / speed,
    )  # fmt: skip
    points = disturbed(block((0, 0, 0), (2, 0, 2), spacing, 2), 0.1 * spacing, 1) % 2.0 * (1, 0, 1)
    x, z = np.pi * points[:, 0], np.pi * points[:, 2]
    flow = np.stack([np.sin(x) * np.cos(z), 0.0 * x, -np.cos(x) * np.sin(z)], axis=1)
    fluid.add_particles(points, phase="water", velocity=speed * flow)
    return fluid


def drop(make_fluid, speed):
    """A disc with a free surface, drawn out along z at `speed` [m/s] at its edge."""
    fluid = make_fluid(
        dimension=2, gravity=(0.0, 0.0, 0.0), maximum_time_step=STEP / speed, minimum_time_step=1e-4 / speed,
        lower=(-3.0, -1.0, -3.0), upper=(3.0, 1.0, 3.0),
    )  # fmt: skip
    points = disturbed(sphere((0, 0, 0), 1.0, 0.1, 2), 0.01, 1) * (1, 0, 1)
    fluid.add_particles(points, phase="water", velocity=speed * points * (-1.0, 0.0, 1.0))
    return fluid


def after(fluid, speed, unit=None):
    """Positions (N, 3) [m] and velocities [m/s] over `speed` after STEPS; `unit` [s]: a fixed one in place of the flow's."""
    if unit is not None:
        fluid.arrays.sums.time_unit, fluid.context.constants.weightless = unit, False
    for _ in range(STEPS):
        fluid.advance(STEP / speed)
    return fluid.phase_positions("water"), fluid.phase_velocities("water") / np.float32(speed)


@pytest.mark.parametrize("flow", [vortices, drop])
def test_twice_the_speed_is_the_same_flow_in_half_the_time(make_fluid, flow):
    # times and speeds differ by powers of two, which no rounding sees
    slow, fast = (after(flow(make_fluid, speed), speed) for speed in (0.5, 1.0))
    assert np.array_equal(slow[0], fast[0])
    assert np.array_equal(slow[1], fast[1])


def difference(flow, make_fluid, unit=None):
    """Root mean square of the velocities' difference, of flows at 0.1 and 1 m/s, over their speed."""
    slow, fast = (after(flow(make_fluid, speed), speed, unit)[1] for speed in (0.1, 1.0))
    return np.sqrt(((slow - fast) ** 2).sum(axis=1).mean())


# rounding differs, and solves end somewhere below a compression of 1e-4 a step: what that allows in speed
SAME = 1e-4 * 0.1 / STEP


@pytest.mark.parametrize("flow", [vortices, drop])
def test_any_speed_is_the_same_flow_to_the_solves_tolerance(make_fluid, flow):
    assert difference(flow, make_fluid) < SAME


@pytest.mark.parametrize("flow", [vortices, drop])
def test_a_fixed_unit_makes_it_another_flow(make_fluid, flow):
    assert difference(flow, make_fluid, unit=0.065) > 10 * SAME


def test_the_filter_has_run(make_fluid):
    # or the flows above would be similar without it
    fluid = vortices(make_fluid, 1.0)
    fluid.watch()
    for _ in range(STEPS):
        assert fluid.advance(STEP).budget.part("smoothing").kinetic < 0.0


def test_resting_liquid_stays_at_rest(make_fluid):
    fluid = vortices(make_fluid, 1.0)
    fluid.state.velocity[:] = 0.0
    for _ in range(5):
        fluid.advance(STEP)
    assert fluid.arrays.sums.time_unit > 1e3
    assert np.abs(fluid.state.velocity).max() < 1e-3


def test_threads_do_not_change_a_bit(make_fluid):
    one, two = (after(vortices(make_fluid, 1.0, threads, 0.04), 1.0) for threads in (1, 2))
    assert len(one[0]) > 2048
    assert np.array_equal(one[0], two[0])
    assert np.array_equal(one[1], two[1])


def test_restored_flow_continues_bit_for_bit(make_fluid):
    fluid = vortices(make_fluid, 1.0)
    for _ in range(5):
        fluid.advance(STEP)
    saved, other = fluid.save_state(), vortices(make_fluid, 1.0)
    other.restore_state(saved)
    first, second = after(fluid, 1.0), after(other, 1.0)
    assert np.array_equal(first[0], second[0])
    assert np.array_equal(first[1], second[1])
