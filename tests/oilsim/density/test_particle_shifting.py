"""The filter takes noise and leaves linear flow and momentum alone; shifts even out positions, not velocities."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import Phase, block, tank_walls
from oilsim.density.particle_shifting import (
    INERTIA,
    Relaxation,
    RelaxationConstants,
    push_beside_wall,
    relax,
    shift_balance,
)
from oilsim.neighborhood.smoothing_kernels import SUPPORT, kernel_slope_over_q, lattice
from oilsim.stages.explicit import wrap_periodic
from tests.oilsim.conftest import disturbed, relax_once, search
from tests.oilsim.gradients.test_particle_sums import EPSILON, SPACING, fields, linear_field

TWO = (Phase(name="water", rest_density=1000.0), Phase(name="oil", rest_density=800.0))


def blob(make_fluid, dimension, velocity, *, phases=None, seed=0, amount=0.01, **options):
    """A disturbed block of 10 or 20 particles a side with velocity(points) in free space."""
    settings = {"gravity": (0.0, 0.0, -9.81), "dimension": dimension, **options}
    fluid = make_fluid(**settings, **({} if phases is None else {"phases": phases}))
    low, high = ((0.5,) * 3, (1.5,) * 3) if dimension == 3 else ((0.1,) * 3, (1.9,) * 3)
    points = disturbed(block(low, high, SPACING, dimension), amount, seed)
    if dimension == 2:
        points[:, 1] = 0.0
    speeds = velocity(points)
    half = np.arange(len(points)) % 2 == 0
    fluid.add_particles(points[half], phase="water", velocity=speeds[half])
    fluid.add_particles(points[~half], phase="water" if phases is None else "oil", velocity=speeds[~half])
    return fluid


def inside(fluid, margin):
    """Particles further than `margin` [m] from the bounds of all."""
    position = fluid.state.position[[0, 2]] if fluid.config.dimension == 2 else fluid.state.position
    low, high = position.min(axis=1, keepdims=True), position.max(axis=1, keepdims=True)
    return ((position > low + margin) & (position < high - margin)).all(axis=0)


def filtered(fluid, theta):
    """What the filter alone (no multipliers, so no shift) adds to velocities (3, N), for a given theta."""
    context, arrays, state = fluid.context, fluid.arrays, fluid.state
    _, _, flow, _ = fields(fluid)
    relaxation = Relaxation(*np.zeros((4, 3, state.count), np.float32))
    constants = RelaxationConstants(
        balance=np.float32(shift_balance(fluid.config.dimension)), theta=np.float32(theta), inertia=np.float32(0.0),
        touching=context.constants.touching_wall,
    )  # fmt: skip
    relax(
        0,
        state.count,
        constants,
        arrays.neighbors.neighborhood,
        flow,
        np.zeros(state.count, np.float32),
        True,
        relaxation,
    )
    assert not relaxation.push.any() and not relaxation.shift.any()
    return relaxation.change.astype(np.float64)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("phases", [None, TWO])
def test_filter_conserves_momentum(make_fluid, dimension, phases):
    rng = np.random.default_rng(2)
    fluid = blob(
        make_fluid,
        dimension,
        lambda p: rng.normal(0.0, 0.3, p.shape) * ((1, 0, 1) if dimension == 2 else 1),
        phases=phases,
    )
    change = filtered(fluid, 0.7)
    mass = fluid.arrays.neighbors.rest_density.astype(np.float64)
    moved = (np.abs(change) * mass).sum()
    assert moved > 0.01 * (np.abs(fluid.state.velocity) * mass).sum()
    # each pair's share is the same to a few roundings
    assert np.abs(change @ mass).max() < 8 * EPSILON * moved


@pytest.mark.parametrize("dimension", [2, 3])
def test_filter_takes_noise_and_leaves_linear_flow(make_fluid, dimension):
    slope = linear_field(dimension, 5)
    rng = np.random.default_rng(3)
    noise = []

    def velocity(points):
        noise.append(rng.normal(0.0, 0.1, points.shape) * ((1, 0, 1) if dimension == 2 else 1))
        return noise[0]

    calm = blob(make_fluid, dimension, lambda p: (p - 1.0) @ slope.T)
    # particles on edges of the block have no gradient; their neighbours' filter sees that
    core = inside(calm, 3 * SPACING)
    # velocities of 3 m/s, each known to EPSILON; a gradient's error over a spacing is of the same order
    change = filtered(calm, 1.0)[:, core]
    assert np.abs(change).max() < 100 * EPSILON * np.abs(calm.state.velocity).max()
    noisy = blob(make_fluid, dimension, velocity)
    change = filtered(noisy, 1.0)
    before = noisy.state.velocity.astype(np.float64)
    after = before + change
    core = inside(noisy, 3 * SPACING)
    # v_i - sum V W (v_i - v_j + G x): white noise keeps about V W_0 of itself and the mean of the rest
    assert (after[:, core] ** 2).sum() < 0.5 * (before[:, core] ** 2).sum()


@pytest.mark.parametrize("dimension", [2, 3])
def test_filter_carries_no_velocity_from_one_liquid_to_another(make_fluid, dimension):
    """A particle of oil that moves through water keeps its speed; a particle of water that does so is stopped."""
    kept = []
    for liquid in (1, 0):
        fluid = blob(make_fluid, dimension, np.zeros_like, phases=TWO)
        state, centre = fluid.state, np.array([[1.0], [0.0 if dimension == 2 else 1.0], [1.0]])
        mover = int(np.argmin(((state.position - centre) ** 2).sum(axis=0)))
        state.velocity[0, mover], state.phase[:] = 1.0, 0
        state.phase[mover], name = liquid, state.id[mover]
        change = filtered(fluid, 1.0)[0]  # in another order
        kept.append(float(1.0 + change[state.id == name][0]))
    assert kept[0] == 1.0
    assert kept[1] < 0.5


@pytest.mark.parametrize(("rows", "tension", "left"), [(16, 0.0, 1.0), (16, 1e-3, 1.0), (2, 0.0, 0.8)])
@pytest.mark.parametrize("lighter", [1000.0, 850.0])
def test_thick_liquids_slip_past_each_other_and_thin_ones_follow(make_fluid, lighter, rows, tension, left):
    """Layers pass each other by half a metre, eight spacings; with the filter across, thick ones would lose 3.9 % of their speeds."""
    phases = (TWO[0], Phase(name="oil", rest_density=lighter, interfacial_tension=tension))
    fluid = make_fluid(
        particle_spacing=1 / 16, dimension=2, phases=phases, gravity=(0.0, 0.0, 0.0), periodic=(True, False, True),
        lower=(0.0, -1.0, 0.0), upper=(1.0, 1.0, 2.0),
    )  # fmt: skip
    points = block((0, 0, 0), (1, 0, 2), 1 / 16, 2)
    middle = np.abs(points[:, 2] - 1.0) < rows / 32
    fluid.add_particles(points[~middle], phase="water", velocity=(-0.5, 0.0, 0.0))
    fluid.add_particles(points[middle], phase="oil", velocity=(0.5, 0.0, 0.0))
    fluid.advance(0.5)
    slip = fluid.phase_velocities("oil")[:, 0].mean() - fluid.phase_velocities("water")[:, 0].mean()
    assert slip == pytest.approx(left, abs=0.005 if rows > 2 else 0.03)


@pytest.mark.parametrize("dimension", [2, 3])
def test_relaxation_moves_particles_within_a_linear_flow(make_fluid, dimension):
    slope = linear_field(dimension, 6)
    fluid = blob(make_fluid, dimension, lambda p: (p - 1.0) @ slope.T, amount=0.02)
    state = fluid.state
    search(fluid)
    core = inside(fluid, 3 * SPACING)
    before, velocity = state.position.copy(), state.velocity.copy()
    relax_once(fluid, 0.005)
    # no motion becomes velocity: all have the one that the flow has where they are put; it has no noise to filter but round-off
    moved = state.position + state.shift - before
    assert np.linalg.norm(moved, axis=0)[core].max() > 1e-3 * SPACING
    expected = velocity + slope.astype(np.float32) @ moved
    assert np.abs(state.velocity - expected)[:, core].max() < 100 * EPSILON * np.abs(velocity).max()


@pytest.mark.slow
def test_shifts_even_out_neighbours(make_fluid):
    # in a closed periodic box: the spread of densities and |g|, 0 on a lattice, fall; the mean density is given
    fluid = make_fluid(dimension=2, periodic=(True, False, True), gravity=(0.0, 0.0, 0.0))
    points = disturbed(block((0, 0, 0), (2, 0, 2), SPACING, 2), 0.02, 1) % 2.0
    points[:, 1] = 0.0
    fluid.add_particles(points, phase="water")
    spread = []
    for _ in range(100):
        compression, gradient, _, _ = fields(fluid)
        spread.append((compression.std(), np.sqrt((gradient**2).sum(axis=0).mean()) * SPACING))
        relax_once(fluid, 0.1)
        wrap_periodic(fluid.state.position, fluid.config.lower, fluid.context.constants.period)
    assert not fluid.arrays.sums.surface.any()
    assert spread[-1][0] < 0.1 * spread[0][0]
    assert spread[-1][1] < 0.5 * spread[0][1]


def test_relaxation_conserves_momentum_of_a_flow(make_fluid):
    # a vortex of a wavelength of 2 m on disordered particles: G differs from particle to particle
    def vortex(points):
        x, z = np.pi * points[:, 0], np.pi * points[:, 2]
        return np.stack([np.sin(x) * np.cos(z), 0.0 * x, -np.cos(x) * np.sin(z)], axis=1)

    fluid = make_fluid(dimension=2, periodic=(True, False, True), gravity=(0.0, 0.0, 0.0))
    points = disturbed(block((0, 0, 0), (2, 0, 2), SPACING, 2), 0.02, 1) % 2.0
    points[:, 1] = 0.0
    fluid.add_particles(points, phase="water", velocity=vortex(points))
    search(fluid)
    before, velocity = fluid.momentum(), fluid.state.velocity.copy()
    relax_once(fluid, 0.1)
    mass = 1000.0 * SPACING**2
    changed = mass * np.abs(fluid.state.velocity.astype(np.float64) - velocity).sum()
    assert changed > 0.0
    # velocities of 1 m/s are stored to half an EPSILON each
    roundoff = mass * EPSILON * np.abs(velocity).sum()
    assert np.abs(fluid.momentum() - before).max() < 1e-5 * changed + roundoff


@pytest.mark.parametrize("dimension", [2, 3])
def test_shift_has_no_virial_on_a_lattice(dimension):
    # sum_j (1 - a q^2) x_ij . grad W_ij = 0: particles are not driven to where the shift is weaker
    points = lattice(1.0, dimension)
    q = np.linalg.norm(points, axis=1) / SUPPORT
    virial = q**2 * kernel_slope_over_q(q, 1.0)
    balanced = (1.0 - shift_balance(dimension) * q**2) * virial
    assert abs(balanced.sum()) < 1e-12 * np.abs(virial).sum()
    # neighbours at a spacing are driven apart
    assert balanced[np.isclose(q, 1.0 / SUPPORT)].sum() < 0.0


@pytest.mark.parametrize("dimension", [2, 3])
def test_shift_leaves_the_centre_of_mass_where_it_is(make_fluid, dimension):
    # away from walls relaxation exchanges m dx between the two of a pair, of whatever phases
    fluid = blob(make_fluid, dimension, lambda p: np.sin(3.0 * p) * ((1, 0, 1) if dimension == 2 else 1), phases=TWO)
    arrays, state = fluid.arrays, fluid.state
    search(fluid)
    before = state.position.astype(np.float64)
    relax_once(fluid, 0.005)
    moved = (state.position - before + state.shift) * arrays.neighbors.rest_density
    assert np.abs(state.shift).sum() > 0.0
    assert np.abs(moved).sum() > 0.0
    # positions of 2 m are stored to half an EPSILON each
    assert np.abs(moved.sum(axis=1)).max() < 1e-5 * np.abs(moved).sum() + 1000.0 * EPSILON * np.sqrt(state.count)


@pytest.mark.parametrize("dimension", [2, 3])
def test_further_passes_repeat_pushes_and_a_step_shifts_once(make_fluid, dimension):
    fluid = blob(make_fluid, dimension, linear_shear, density_tolerance=1e-6, density_iterations=3)
    context, run, pushes, alone, shifts = fluid.context, fluid.context.team.run, [], [], []
    fluid.state.position *= np.float32(0.98)

    def watch(kernel, count, *arguments):
        if kernel is relax:
            fresh = Relaxation(*np.zeros((4, 3, count), np.float32))
            run(kernel, count, *arguments[:-1], fresh)
            alone.append(fresh.push)
        run(kernel, count, *arguments)
        if kernel is relax:
            pushes.append(arguments[-1].push.copy())
            shifts.append(arguments[-1].shift.copy())

    context.team.run = watch
    search(fluid)
    relax_once(fluid, 0.01)
    assert np.array_equal(pushes[0], alone[0])
    for before, push, fresh in zip(pushes, pushes[1:], alone[1:], strict=False):
        assert np.allclose(push, fresh + INERTIA * before, atol=1e-6 * np.abs(push).max())
        assert np.abs(push - fresh).max() > 0.1 * np.abs(push).max()
    assert shifts[0].any() and all(np.array_equal(shift, shifts[0]) for shift in shifts)


@pytest.mark.parametrize("dimension", [2, 3])
def test_shift_is_made_before_densities_are_looked_at(make_fluid, dimension):
    def relaxed(moved, shift):
        """Positions after a relaxation of particles that have `moved` already and have a `shift` to make, lists from before both."""
        fluid = blob(make_fluid, dimension, lambda points: 0.0 * points)
        search(fluid)
        fluid.state.position += moved * fluid.state.position
        fluid.state.shift[:] = shift * fluid.state.position
        relax_once(fluid, 1e-9)
        return fluid.state.position.astype(np.float64)

    # drawn together by 1 % and looked at, particles are pushed apart; looked at first, they would end a hundredth of it further in
    assert np.abs(relaxed(0.0, -0.01) - relaxed(-0.01, 0.0)).max() < 1e-6
    assert np.abs(relaxed(0.0, -0.01) - 0.99 * relaxed(0.0, 0.0)).max() > 1e-4


def linear_shear(points):
    """A velocity (K, 3) [m/s] that grows by 20 m/s a metre."""
    return 20.0 * np.stack([points[:, 2], 0.0 * points[:, 0], 0.0 * points[:, 0]], axis=1)


@pytest.mark.parametrize("light", [800.0, 100.0, 20.0])
@pytest.mark.parametrize("dimension", [2, 3])
def test_however_light_a_liquid_is_pairs_keep_their_centre_of_mass_and_nobody_is_thrown(make_fluid, dimension, light):
    # by the ratio of densities, as in Eq. 22, the lighter of two liquids went up to 20 spacings at 100 kg/m3, and 77 at 20
    phases = (TWO[0], Phase(name="oil", rest_density=light))
    fluid = blob(make_fluid, dimension, np.zeros_like, phases=phases, amount=0.05 * SPACING)
    state = fluid.state
    ways, arrays = [], fluid.arrays
    for _ in range(5):
        search(fluid)
        before, mass = state.position.copy(), np.array([phase.rest_density for phase in phases])[state.phase]
        relax_once(fluid, 0.01)
        ways.append(np.sqrt(((state.position - before) ** 2).sum(axis=0)))
        drift = (mass * (state.position - before).astype(np.float64)).sum(axis=1)
        assert np.abs(drift).max() < 1e-3 * (mass * ways[-1]).sum()  # places are rounded
    assert np.max(ways) < 0.25 * SPACING
    assert arrays.sums.compression.max() < 0.02


def test_order_of_the_phases_does_not_matter(make_fluid):
    found = []
    for phases in (TWO, TWO[::-1]):
        fluid = blob(make_fluid, 3, np.zeros_like, phases=phases, amount=0.1 * SPACING)
        search(fluid)
        relax_once(fluid, 0.01)
        found.append(fluid.state.position[:, np.argsort(fluid.state.id)])
    assert found[0] == pytest.approx(found[1], abs=1e-6)


def test_nothing_is_pushed_into_a_wall_that_it_has_reached():
    reached, into = np.float32(0.5), (np.float32(3.0), np.float32(0.0), np.float32(4.0))

    def pushed(push, own, content):
        x, y, z = (np.float32(component) for component in push)
        return np.array(push_beside_wall(x, y, z, np.float32(own), np.float32(content), into, reached))

    # along the wall it may go on, off the wall and before it is reached it goes where it is pushed
    np.testing.assert_allclose(pushed((1.0, 2.0, 0.5), 0.0, 0.6), (0.4, 2.0, -0.3), atol=1e-6)
    np.testing.assert_allclose(pushed((-1.0, 2.0, 0.5), 0.0, 0.6), (-1.0, 2.0, 0.5), atol=1e-6)
    np.testing.assert_allclose(pushed((1.0, 2.0, 0.5), 0.0, 0.4), (1.0, 2.0, 0.5), atol=1e-6)
    # its own multiplier, which would draw it there, counts as a push
    np.testing.assert_allclose(pushed((0.0, 1.0, 0.0), 0.1, 0.6), (0.0, 1.0, 0.0), atol=1e-6)


def test_a_box_with_a_tenth_too_many_particles_tells_how_it_is_pressed_together(make_fluid):
    """440 particles in a closed plane box of 400: no solve can change their mean, and report and ledger have it all the same."""
    fluid = make_fluid(particle_spacing=0.1, dimension=2, lower=(-0.5,) * 3, upper=(2.5,) * 3, gravity=(0.0, 0.0, 0.0))
    fluid.add_boundary(tank_walls((0, 0, 0), (2, 0, 2), 0.1, sides=("-x", "+x", "-z", "+z"), dimension=2))
    points = block((0, 0, 0), (2.2, 0, 2), 0.1, 2)
    points[:, 0] /= 1.1
    fluid.add_particles(points, phase="water")
    fluid.watch()
    for _ in range(10):
        report = fluid.advance(0.02)
    assert report.crowding == pytest.approx(0.1, abs=0.02)  # walls press with the density of the lattice
    assert report.density_error < 1e-3
    assert report.crowding < report.density_error_max < report.crowding + 0.03
    assert report.budget.compression.mean == pytest.approx(report.crowding, abs=1e-3)
