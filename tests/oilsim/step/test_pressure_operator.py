"""The pressure's operator: H and its transpose are adjoint, A is symmetric and positive, no momentum is lost, water lies still."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import BoundaryParticles, Phase, block, tank_walls
from oilsim.neighborhood.smoothing_kernels import SUPPORT, lattice_moment
from tests.oilsim.conftest import cache, disturbed, operator_of, search

TWO = (Phase(name="water", rest_density=1000.0), Phase(name="oil", rest_density=800.0))
SPACING = 0.1
BODY_MASS, BODY_INERTIA = 2.0, 0.1
ROUNDOFF = 1e-5  # sums of 80 pairs and some thousand particles in float32, where up to nine tenths cancel


def add_body(fluid, position, name):
    """A free block of 2 x 2 x 2 points that moves and turns."""
    points = block((-0.1, -0.1, -0.1), (0.1, 0.1, 0.1), 0.1)
    body = BoundaryParticles(name=name, position=points, volume=np.full(8, 5e-4), area=np.zeros(8))
    handle = fluid.add_boundary(body)
    inverse_mass = np.diag([1.0 / BODY_MASS] * 3 + [1.0 / BODY_INERTIA] * 3)
    fluid.set_boundary_motion(
        handle, position, (0, 0, 0, 1), (0.3, -0.2, -1.0), (0.2, 0.1, 0.4), inverse_mass, np.zeros(6)
    )
    return handle


def scene(make_fluid, kind, *, dimension=3, seed=0, isotropic=False, scheme="split"):
    """Disordered oil and water, ready for the operator: free in "space", in a "periodic" box, in a "tank", or with "bodies".

    Y is random, different from particle to particle and not isotropic, and no larger than `largest_stretch`: what holds, holds for any.
    """
    rng = np.random.default_rng(seed)
    periodic = (True, dimension == 3, True) if kind == "periodic" else (False, False, False)
    fluid = make_fluid(
        phases=TWO, dimension=dimension, gravity=(0.0, 0.0, 0.0), periodic=periodic, scheme=scheme,
        lower=(0.0,) * 3 if kind == "periodic" else (-0.5,) * 3, upper=(1.0,) * 3 if kind == "periodic" else (1.5,) * 3,
    )  # fmt: skip
    points = disturbed(block((0, 0, 0), (1, 1, 1), SPACING, dimension), 0.01, seed)
    if dimension == 2:
        points[:, 1] = 0.0
    if kind == "periodic":
        points = points % 1.0
    centres = [(0.5, 0.5, 1.05), (0.0, 0.4, 0.5)] if kind in ("bodies", "bodies in a tank") else []
    for n, centre in enumerate(centres):
        add_body(fluid, centre, f"body {n}")
        points = points[np.abs(points - centre).max(axis=1) > 0.14]
    if kind in ("tank", "bodies in a tank"):
        sides = ("-x", "+x", "-z") + (("-y", "+y") if dimension == 3 else ())
        fluid.add_boundary(tank_walls((0, 0, 0), (1, 1, 1), SPACING, sides=sides, dimension=dimension))
    half = rng.random(len(points)) < 0.5
    fluid.add_particles(points[half], phase="water")
    fluid.add_particles(points[~half], phase="oil")
    arrays, state = fluid.arrays, fluid.state
    search(fluid)
    if scheme == "split":
        arrays.sums.matrix[:] = 0.0
        arrays.sums.matrix[:, [0, 3, 5]] = 1.0 / lattice_moment(dimension)
        if not isotropic:
            entries = [0, 2, 5] if dimension == 2 else range(6)
            for entry in entries:
                arrays.sums.matrix[:, entry] += (
                    rng.uniform(-0.4, 0.0, state.count) if entry in (0, 3, 5) else rng.uniform(-0.1, 0.1, state.count)
                )
    cache(fluid)
    return fluid, operator_of(fluid)


def applied(fluid, operator, kappa):
    """What the liquid's velocities (3, N) lose by `kappa`, and the impulses (bodies, 6) that bodies get."""
    bodies = fluid.context.walls.moving.values()
    kept = [(body.impulse.copy(), body.twist.copy()) for body in bodies]
    fluid.state.velocity[:] = 0.0
    operator.accelerate(kappa)
    impulses = np.array([body.impulse - impulse for body, (impulse, _) in zip(bodies, kept, strict=True)])
    for body, (impulse, twist) in zip(bodies, kept, strict=True):
        body.impulse, body.twist = impulse, twist
    return -fluid.state.velocity.astype(np.float64), impulses.reshape(-1, 6)


def image(operator, kappa):
    result = np.empty_like(kappa)
    operator.apply(kappa, result)
    return result.astype(np.float64)


SCENES = [
    ("space", 3),
    ("periodic", 2),
    ("periodic", 3),
    ("tank", 2),
    ("tank", 3),
    ("bodies", 3),
    ("bodies in a tank", 3),
]


@pytest.mark.parametrize("scheme", ["split", "paper"])
@pytest.mark.parametrize(("kind", "dimension"), SCENES)
def test_operator_is_symmetric(make_fluid, kind, dimension, scheme):
    fluid, operator = scene(make_fluid, kind, dimension=dimension, scheme=scheme)
    x, y = np.random.default_rng(7).normal(size=(2, fluid.particle_count)).astype(np.float32)
    ax, ay = image(operator, x), image(operator, y)
    assert x @ ay == pytest.approx(y @ ax, abs=ROUNDOFF * np.sqrt((x @ ax) * (y @ ay)))


@pytest.mark.parametrize(("kind", "dimension"), SCENES)
def test_part_of_the_operator_has_the_rows_and_columns_of_its_group(make_fluid, kind, dimension):
    fluid, operator = scene(make_fluid, kind, dimension=dimension)
    rng = np.random.default_rng(3)
    group = np.flatnonzero(fluid.state.phase == 1)
    part = operator.part(group)
    for _ in range(2):  # between products of the whole, which leave their traces
        x = rng.normal(size=fluid.particle_count).astype(np.float32)
        image(operator, x)
        alone = np.empty(group.size, np.float32)
        part.apply(x[group], alone)
        others = np.ones(fluid.particle_count, bool)
        others[group] = False
        x[others] = 0.0
        expected = image(operator, x)[group]
        assert alone == pytest.approx(expected, abs=ROUNDOFF * float(np.abs(expected).max()))


@pytest.mark.parametrize("scheme", ["split", "paper"])
@pytest.mark.parametrize(("kind", "dimension"), SCENES)
def test_operator_is_the_energy_of_what_it_does(make_fluid, kind, dimension, scheme):
    # x . A x = sum rho_0 / rho_ref |u|^2 + P . M^-1 P / (V rho_ref): never negative, in smooth pressures and in rough ones
    fluid, operator = scene(make_fluid, kind, dimension=dimension, scheme=scheme)
    context, arrays = fluid.context, fluid.arrays
    x, _, z = fluid.state.position
    rough = np.random.default_rng(5).normal(size=fluid.particle_count)
    for kappa in (rough, np.sin(3.0 * x) + z, np.ones_like(x)):
        kappa = kappa.astype(np.float32)
        change, impulses = applied(fluid, operator, kappa)
        energy = (change**2 / arrays.neighbors.weight).sum()
        energy += sum(p @ (np.array([1 / BODY_MASS] * 3 + [1 / BODY_INERTIA] * 3) * p) for p in impulses) / (
            float(context.constants.volume) * context.constants.reference_density
        )
        scale = float((kappa.astype(np.float64) ** 2 * arrays.pairs.sums.diagonal).sum())
        assert kappa @ image(operator, kappa) == pytest.approx(energy, abs=ROUNDOFF * scale)


@pytest.mark.parametrize("scheme", ["split", "paper"])
@pytest.mark.parametrize(("kind", "dimension"), SCENES)
def test_compression_rate_is_the_transpose_of_the_pressures_effect(make_fluid, kind, dimension, scheme):
    # kappa . H^T v = sum rho_0 / rho_ref u . v - P . V / (V rho_ref), V the twists: what pressure does is what compression costs
    fluid, operator = scene(make_fluid, kind, dimension=dimension, scheme=scheme)
    context, arrays, rng = fluid.context, fluid.arrays, np.random.default_rng(11)
    kappa = rng.normal(size=fluid.particle_count).astype(np.float32)
    velocity = rng.normal(size=(3, fluid.particle_count)).astype(np.float32)
    if dimension == 2:
        velocity[1] = 0.0
    change, impulses = applied(fluid, operator, kappa)
    work_done = (change / arrays.neighbors.weight * velocity).sum()
    for body, impulse in zip(context.walls.moving.values(), impulses, strict=True):
        work_done -= impulse @ body.twist / (float(context.constants.volume) * context.constants.reference_density)
    fluid.state.velocity[:] = velocity
    rate = operator.compression_rate().astype(np.float64)
    scale = np.sqrt((kappa**2).sum() * (rate**2).sum())
    assert kappa @ rate == pytest.approx(work_done, abs=ROUNDOFF * scale)


@pytest.mark.parametrize("scheme", ["split", "paper"])
@pytest.mark.parametrize(("kind", "dimension"), [("space", 3), ("periodic", 2), ("periodic", 3), ("bodies", 3)])
def test_pressure_conserves_momentum_of_liquid_and_bodies(make_fluid, kind, dimension, scheme):
    fluid, operator = scene(make_fluid, kind, dimension=dimension, scheme=scheme)
    kappa = np.random.default_rng(3).random(fluid.particle_count).astype(np.float32)
    change, impulses = applied(fluid, operator, kappa)
    lost = change * fluid.arrays.neighbors.rest_density * float(fluid.context.constants.volume)
    if kind == "bodies":
        # both bodies are pushed
        assert (np.linalg.norm(impulses[:, :3], axis=1) > 1e-3 * np.abs(lost).sum()).all()
    assert np.abs(impulses[:, :3].sum(axis=0) - lost.sum(axis=1)).max() < ROUNDOFF * np.abs(lost).sum()


@pytest.mark.parametrize("scheme", ["split", "paper"])
@pytest.mark.parametrize("kind", ["space", "bodies"])
def test_plain_pressure_conserves_angular_momentum(make_fluid, kind, scheme):
    # with plain gradients the forces of pairs are central; with exact ones (Y = M^-1) they are not
    fluid, operator = scene(make_fluid, kind, isotropic=True, scheme=scheme)
    kappa = np.random.default_rng(3).random(fluid.particle_count).astype(np.float32)
    change, impulses = applied(fluid, operator, kappa)
    lost = (change * fluid.arrays.neighbors.rest_density * float(fluid.context.constants.volume)).T
    spin = np.cross(fluid.state.position.T.astype(np.float64), lost).sum(axis=0)
    for body, impulse in zip(fluid.context.walls.moving.values(), impulses, strict=True):
        spin -= np.cross(body.position, impulse[:3]) + impulse[3:]
    # arms of 1 m
    assert np.abs(spin).max() < ROUNDOFF * np.abs(lost).sum()


@pytest.mark.parametrize("dimension", [2, 3])
def test_hydrostatic_pressure_balances_gravity_up_to_the_walls_and_corners(make_fluid, dimension):
    # on a lattice: 2 kappa_i sum G = 0 and sum G x^T = 1, the walls taking the extrapolated pressure
    fluid = make_fluid(dimension=dimension, lower=(-0.5,) * 3, upper=(1.5,) * 3)
    sides = ("-x", "+x", "-z") + (("-y", "+y") if dimension == 3 else ())
    fluid.add_boundary(tank_walls((0, 0, 0), (1, 1, 1), SPACING, sides=sides, dimension=dimension))
    fluid.add_particles(block((0, 0, 0), (1, 1, 0.8), SPACING, dimension), phase="water")
    arrays, state = fluid.arrays, fluid.state
    search(fluid)
    arrays.sums.matrix[:] = 0.0
    arrays.sums.matrix[:, [0, 3, 5]] = 1.0 / lattice_moment(dimension)
    cache(fluid)
    kappa = (0.8 - state.position[2]).astype(np.float32)
    change, _ = applied(fluid, operator_of(fluid), kappa)
    # a particle's moment is whole two supports under the surface, its neighbours' one: the force needs only the first
    inside = state.position[2] < 0.8 - SUPPORT * SPACING
    assert inside.sum() >= 5 * 10 ** (dimension - 1)
    # u = grad kappa = (0, 0, -1); kappa / d = 8, and each of a sum of 80 vectors is rounded by up to half a quantum
    exact = np.array([0.0, 0.0, -1.0])[:, None]
    assert np.abs(change[:, inside] - exact).max() < 8 * 80 * (
        np.finfo(np.float32).eps + arrays.pairs.gradient.quantum * SPACING / 2
    )


@pytest.mark.parametrize(
    ("kind", "scheme"), [("space", "split"), ("periodic", "split"), ("tank", "paper"), ("bodies", "paper")]
)
def test_diagonal_is_that_of_the_operator(make_fluid, kind, scheme):
    # beside walls the split scheme's leaves out what neighbours make of a particle's pressure by extrapolation
    fluid, operator = scene(make_fluid, kind, scheme=scheme)
    for i in np.random.default_rng(0).choice(fluid.particle_count, 20, replace=False):
        unit = np.zeros(fluid.particle_count, np.float32)
        unit[i] = 1.0
        assert image(operator, unit)[i] == pytest.approx(float(fluid.arrays.pairs.sums.diagonal[i]), rel=ROUNDOFF)
