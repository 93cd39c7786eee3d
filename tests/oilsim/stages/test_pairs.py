"""Two particles: pair vectors, the pressure's effect, viscosity and relaxation against their formulas."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import Phase, block
from oilsim.core.state import Confinement
from oilsim.neighborhood.smoothing_kernels import kernel, kernel_slope_over_q, normalisation
from oilsim.stages.pairs import cache_pair_gradients, search_neighbors
from oilsim.stages.pressure import PressureOperator, minority_phases
from oilsim.stages.relaxation import carry_along, confinement, mean_compression, relax_positions
from oilsim.stages.viscosity import apply_viscosity, begin_viscosity, viscous_system
from oilsim.step.arrays import NeighborSums, StepArrays
from tests.oilsim.stages.conftest import SPACING, state_of

DISTANCE, SUPPORT, VOLUME = 0.09, 2.75 * SPACING, SPACING**3
PAIR = [[0.0, 0.0, 0.0], [DISTANCE, 0.0, 0.0]]


def prepared(context, state):
    """Neighbours, sums and pair vectors of the paper's scheme."""
    arrays = StepArrays.of(context)
    arrays.neighbors = search_neighbors(context, state)
    arrays.sums = NeighborSums.of(state.listed, context.time_unit)
    arrays.pairs = cache_pair_gradients(context, arrays.neighbors, arrays.sums, state.position, arrays.pairs)
    return arrays


def slope():
    """V dW/dr of the pair [1/m]."""
    q = DISTANCE / SUPPORT
    return VOLUME * kernel_slope_over_q(q, normalisation(SPACING, 3)) * q / SUPPORT


@pytest.mark.parametrize("phases", [(0, 0), (0, 1)])
def test_pressure_pushes_a_pair_apart(make_context, phases):
    # v_i -= (rho_ref / rho_i) (kappa_i + kappa_j) V grad W_ij, and A_ii = |G|^2 (w_i + w_j) for one neighbour
    context, state = make_context(scheme="paper"), state_of(PAIR, phases=phases)
    arrays = prepared(context, state)
    operator = PressureOperator(context, arrays.neighbors, arrays.pairs, state.velocity, filled=False)
    operator.accelerate(np.array([2.0, 3.0], np.float32))
    weight = np.where(state.phase == 1, 1.25, 1.0)
    expected = weight * 5.0 * slope() * np.array([1.0, -1.0])
    assert expected[0] < 0.0
    np.testing.assert_allclose(state.velocity[0], expected, rtol=1e-4)  # pair vectors have 15 bits
    np.testing.assert_allclose(arrays.pairs.sums.diagonal, slope() ** 2 * weight.sum(), rtol=2e-4)


def test_a_pair_that_approaches_is_compressed(make_context):
    # (1/rho) D rho / Dt = V (v_i - v_j) . grad W_ij, which is the same for both
    context, state = make_context(scheme="paper"), state_of(PAIR, [[1.0, 0.2, 0.0], [-2.0, 0.0, 0.1]])
    arrays = prepared(context, state)
    operator = PressureOperator(context, arrays.neighbors, arrays.pairs, state.velocity, filled=False)
    np.testing.assert_allclose(operator.compression_rate(), -3.0 * slope(), rtol=1e-4)


def test_viscosity_takes_the_relative_motion_along_the_line_and_keeps_momentum(make_context):
    thick = Phase(name="oil", rest_density=800.0, dynamic_viscosity=50.0)
    context, state = make_context(phases=(thick,), scheme="paper"), state_of(PAIR, [[1.0, 0.5, 0.0], [-1.0, 0.0, 0.0]])
    state.viscous_time = np.zeros(1)
    arrays = prepared(context, state)
    step = begin_viscosity(context, state, 0.1)
    system = viscous_system(context, arrays.neighbors, arrays.pairs, state.phase, None, step.due.matrix)
    apply_viscosity(context, system, arrays.neighbors, arrays.pairs, state.velocity, step)
    np.testing.assert_allclose(state.velocity.sum(axis=1), [0.0, 0.5, 0.0], atol=1e-6)
    assert 0.0 < state.velocity[0, 0] - state.velocity[0, 1] < 1.0
    np.testing.assert_allclose(state.velocity[1:], [[0.5, 0.0], [0.0, 0.0]], atol=1e-6)  # not across


def test_relaxation_parts_particles_that_are_too_close(make_context):
    # a lattice squeezed by 4 % along each axis: it grows, its centre stays, and nothing becomes velocity
    context, state = make_context(), state_of(0.96 * block((-0.4,) * 3, (0.4,) * 3, SPACING))
    extent = float(state.position.max())
    before = state.position.mean(axis=1, dtype=np.float64)
    neighbors = search_neighbors(context, state)
    relaxed = relax_positions(context, neighbors, state, 1e-3, context.time_unit)
    assert relaxed.passes > 1 and relaxed.left <= context.config.density_tolerance
    np.testing.assert_allclose(state.position.mean(axis=1, dtype=np.float64), before, atol=1e-6)
    np.testing.assert_allclose(state.velocity, 0.0, atol=1e-6)
    assert state.position.max() > extent


def test_compression_of_a_pair_is_that_of_the_kernel(make_context):
    # e = V (W(0) + W(r)) - 1
    context, state = make_context(), state_of(PAIR)
    relaxed = relax_positions(context, search_neighbors(context, state), state, 1e-3, context.time_unit)
    sigma = normalisation(SPACING, 3)
    expected = VOLUME * (kernel(0.0, sigma) + kernel(DISTANCE / SUPPORT, sigma)) - 1.0
    np.testing.assert_allclose(relaxed.sums.compression, expected, rtol=1e-4)


def test_moved_particles_take_the_flow_of_their_new_places(make_context):
    # dv = G dx less its mean by mass
    context, state = make_context(), state_of(PAIR)
    flow, moved = np.zeros((2, 16), np.float32), np.array([[0.1, 0.0], [0.0, 0.0], [0.0, 0.2]], np.float32)
    flow[:, 3] = 1.0  # weights
    flow[:, 4], flow[:, 14] = 2.0, -1.0  # dv_x/dx, dv_z/dz
    carry_along(context, flow, moved, state.velocity)
    np.testing.assert_allclose(state.velocity.sum(axis=1), 0.0, atol=1e-7)
    assert state.velocity[0, 0] > 0.0 > state.velocity[2, 1]


def test_liquid_fills_its_box_where_no_surface_is_near():
    state = state_of(np.zeros((1000, 3)))
    assert confinement(state, 0) is Confinement.FILLED
    assert confinement(state, 3) is Confinement.OPEN
    state.confinement = Confinement.FILLED
    assert confinement(state, 3) is Confinement.PARTED
    assert confinement(state, 6) is Confinement.OPEN


def test_crowding_of_a_full_box_is_no_compression():
    state, sums = state_of(np.zeros((2, 3))), NeighborSums.of(2, 1.0)
    sums.compression[:] = 0.1, 0.3
    assert mean_compression(sums, state) == pytest.approx(0.2)
    state.confinement = Confinement.FILLED
    assert mean_compression(sums, state) == pytest.approx(0.05)
    assert sums.crowding == pytest.approx(0.2)


def test_the_rarer_liquid_is_watched_with_its_neighbours(make_context):
    context, state = make_context(), state_of([*PAIR, [0.5, 0, 0], [0.55, 0, 0]], phases=(1, 0, 0, 0))
    (group,) = minority_phases(context, search_neighbors(context, state), state.phase)
    np.testing.assert_allclose(np.sort(state.position[0, group]), [0.0, DISTANCE], atol=1e-6)
