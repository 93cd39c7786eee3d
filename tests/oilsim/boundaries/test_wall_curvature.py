"""Curved walls come in on liquid that flies straight: their shape, what they add to compression, and what a bucket keeps by it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from coupling.solids.surface_sampling import boundary_particles
from coupling.solids.surface_shape import surface_shape
from oilsim import BoundaryParticles, Fluid, block, solid_box, tank_walls
from oilsim.boundaries.wall_curvature import add_wall_curvature
from tests.oilsim.conftest import cache, search, sum_up

RADIUS = 0.5  # m


def ring(spacing: float, inside: bool, heights: NDArray[np.float64] | None = None) -> BoundaryParticles:
    """Two layers of a round wall about y in the plane, or about z at `heights` [m]; inside: liquid is inside."""
    points, volumes, areas = [], [], []
    for layer in range(2):
        near, far = (RADIUS + sign * layer * spacing for sign in (1, -1))
        low, high = (near, near + spacing) if inside else (far - spacing, far)
        count = round(math.pi * (low + high) / spacing)
        angle = 2.0 * math.pi * np.arange(count) / count
        around, middle = np.column_stack([np.cos(angle), np.sin(angle)]), 0.5 * (low + high)
        for height in [0.0] if heights is None else heights:
            level = np.full(count, height)
            x, y = middle * around.T
            points.append(np.column_stack([x, level, y] if heights is None else [x, y, level]))
            volumes.append(np.full(count, math.pi * (high**2 - low**2) / count))
            areas.append(np.full(count, 2.0 * math.pi * RADIUS / count if layer == 0 else 0.0))
    depth = 1.0 if heights is None else spacing
    position, area = np.concatenate(points), depth * np.concatenate(areas)
    shape = surface_shape(position, area, spacing, dimension=2 if heights is None else 3)
    return BoundaryParticles(
        name="ring", position=position, volume=depth * np.concatenate(volumes), area=area, curvature=shape
    )  # fmt: skip


def bends(shape: NDArray[np.float64]) -> NDArray[np.float64]:
    """Principal curvatures (M, 3) [1/m] of shapes (M, 9), the least first."""
    return np.linalg.eigvalsh(shape[:, [3, 4, 5, 4, 6, 7, 5, 7, 8]].reshape(-1, 3, 3))


@pytest.mark.parametrize("inside", [True, False])
@pytest.mark.parametrize("layers", [5, 10, 40])
def test_a_round_wall_has_its_curvature_in_each_layer(layers: int, inside: bool) -> None:
    """1/R of each layer's own radius across the axis, and 0 along it; its product with the normal points to the axis."""
    spacing = RADIUS / layers
    flat, tall = ring(spacing, inside), ring(spacing, inside, spacing * np.arange(-8.0, 9.0))
    for wall, dimension in ((flat, 2), (tall, 3)):
        shape, axis = wall.curvature, 1 if dimension == 2 else 2
        assert shape is not None
        inner = np.abs(wall.position[:, axis]) < 1e-9
        out = np.where(np.arange(3) == axis, 0.0, wall.position)[inner]
        radius, trace = np.linalg.norm(out, axis=1), bends(shape[inner]).sum(axis=1)
        # the quadric through an arc of 2.75 d and the step of a layer take 1 / (1 - (d / R)^2)
        assert np.abs(trace) * radius == pytest.approx(np.ones(len(radius)), rel=2.0 / layers**2 + 1e-6)
        assert (np.einsum("ki,ki->k", shape[inner, :3], out) * trace < 0.0).all()
        assert np.abs(shape[inner][:, [4, 6, 7] if dimension == 2 else [5, 7, 8]]).max() * RADIUS < 5e-3


def test_flat_sides_edges_and_corners_have_no_shape(make_fluid) -> None:
    tank = tank_walls((0, 0, 0), (1, 1, 1), 0.1)
    for wall in (tank, solid_box((1.0, 0.7, 0.5), 0.1)):
        assert wall.curvature is None  # which is what a search would find
        assert surface_shape(wall.position, wall.area, 0.1) is None
    fluid = make_fluid()
    fluid.add_boundary(tank)
    fluid.context.walls.place()
    assert fluid.context.walls.curvature.rows is None  # so that a step does not ask


def test_sampled_meshes_are_flat_or_round_as_drawn() -> None:
    """A box has no shape; a sphere of 10 spacings has 1/R of its points in both directions, within what even points scatter."""
    assert boundary_particles("box", trimesh.creation.box((0.6, 0.6, 0.4)), 0.05).curvature is None
    ball = boundary_particles("ball", trimesh.creation.icosphere(3, RADIUS), 0.05)
    assert ball.curvature is not None
    found = bends(ball.curvature) * np.linalg.norm(ball.position, axis=1)[:, None]
    round_ones = np.sort(np.abs(found), axis=1)[:, 1:]
    assert np.abs(round_ones - 1.0).mean() < 0.05
    assert np.abs(round_ones - 1.0).max() < 0.2


def round_fluid(make_fluid, spacing: float, inside: bool, points, curved: bool = True, **options) -> Fluid:
    """Liquid at `points` beside a round wall, without gravity; its handle is 0."""
    fluid = make_fluid(
        dimension=2, particle_spacing=spacing, lower=(-1.5, 0, -1.5), upper=(1.5, 1, 1.5), gravity=(0, 0, 0), **options
    )
    wall = ring(spacing, inside)
    fluid.add_boundary(wall if curved else replace(wall, curvature=None))
    fluid.add_particles(points, phase="water")
    return fluid


def curvature_rate(fluid: Fluid, velocity: NDArray[np.float32], time_step: float) -> NDArray[np.float32]:
    """What `add_wall_curvature` adds to a rate of 0 [1/s]."""
    search(fluid)
    sum_up(fluid, time_step)
    cache(fluid)
    walls, rate = fluid.context.walls, np.zeros(fluid.state.count, np.float32)
    centres = np.ascontiguousarray(walls.twists()[:, :3].T, np.float32)
    add_wall_curvature(
        0, rate.size, fluid.arrays.neighbors.neighborhood, fluid.arrays.pairs.wall_gradient, walls.curvature.rows, (walls.owner, centres),
        velocity, (np.float32(time_step), np.float32(2.0)), rate,
    )  # fmt: skip
    return rate


@pytest.mark.parametrize("inside", [True, False])
def test_a_round_wall_compresses_by_u2_over_r(make_fluid, inside: bool) -> None:
    """w dt u^2 / (2 r) |sum_b G_ib| at the particle's own radius r, above 0 in a bucket and below 0 round a pile; 0 at rest."""
    spacing, time_step, speed = 0.05, 0.01, 3.0
    rows = [RADIUS + (-1 if inside else 1) * (k + 0.5) * spacing for k in range(3)]
    angle = np.linspace(0.0, 2.0 * math.pi, 41)[:-1]
    points = np.concatenate([r * np.column_stack([np.cos(angle), 0 * angle, np.sin(angle)]) for r in rows])
    fluid = round_fluid(make_fluid, spacing, inside, points)
    search(fluid)  # which sorts particles by cell
    x, _, z = fluid.state.position
    radius = np.hypot(x, z)
    around = np.stack([-z / radius, 0.0 * x, x / radius])
    rate = curvature_rate(fluid, speed * around, time_step)
    slope = np.linalg.norm(fluid.arrays.pairs.sums.wall_slope, axis=0)
    beside = radius > rows[1] - 0.1 * spacing if inside else radius < rows[1] + 0.1 * spacing
    expected = (1 if inside else -1) * time_step * speed**2 / radius * slope
    # normals of wall points up to 2.5 d aside turn towards a particle in a bucket, and away from one beside a pile, by up to a quarter
    assert rate[beside] == pytest.approx(expected[beside], rel=0.07)
    assert not curvature_rate(fluid, np.zeros_like(around), time_step).any()
    # straight at the wall, which does not come in on it
    out = speed * np.stack([x / radius, 0.0 * x, z / radius])
    assert np.abs(curvature_rate(fluid, out, time_step)[beside]).max() < 0.1 * np.abs(expected[beside]).max()


def test_liquid_that_travels_with_a_round_body_and_a_body_that_turns_ask_for_nothing(make_fluid) -> None:
    spacing, speed = 0.05, 1.0
    fluid = round_fluid(make_fluid, spacing, False, np.array([[RADIUS + 0.5 * spacing, 0.0, 0.0]]))
    fluid.set_boundary_motion(0, (0, 0, 0), (0, 0, 0, 1), (0, 0, speed), (0, 3.0, 0))
    velocity = np.array([[0.0], [0.0], [speed]], np.float32)
    assert not curvature_rate(fluid, velocity, 0.01).any()
    assert curvature_rate(fluid, -velocity, 0.01)[0] < 0.0
    # a quarter turn brings the same wall
    before = curvature_rate(fluid, -velocity, 0.01)[0]
    half = math.pi / 4.0
    fluid.set_boundary_motion(0, (0, 0, 0), (0, math.sin(half), 0, math.cos(half)), (0, 0, speed), (0, 0, 0))
    assert curvature_rate(fluid, -velocity, 0.01)[0] == pytest.approx(before, rel=0.05)


def test_a_pile_on_a_periodic_border_asks_for_what_it_asks_for_inside(make_fluid) -> None:
    """And never for more than a twentieth of the volume in a step."""
    spacing, time_step, found = 0.05, 0.01, []
    for shift in (0.0, 1.5):
        wall = ring(spacing, False)
        place = np.array([[0.8 * RADIUS - shift, 0.0, 0.8 * RADIUS]])  # beyond the border that the pile lies on
        fluid = make_fluid(
            dimension=2, particle_spacing=spacing, lower=(-1.5, 0, -1.5), upper=(1.5, 1, 1.5), gravity=(0, 0, 0),
            periodic=(True, False, True),
        )  # fmt: skip
        fluid.add_boundary(replace(wall, position=wall.position + np.array([shift, 0.0, 0.0])))
        fluid.add_particles(place, phase="water")
        slow = np.array([[1.0], [0.0], [-1.0]], np.float32)
        found.append(curvature_rate(fluid, slow, time_step)[0])
        assert curvature_rate(fluid, 100.0 * slow, time_step)[0] == pytest.approx(-0.05 / time_step)
    assert found[0] < 0.0
    assert found[1] == pytest.approx(found[0], rel=1e-4)


def discs(spacing: float) -> NDArray[np.float64]:
    """Places (N, 3) [m] of liquid that fills a round bucket in rings."""
    points = []
    for layer in range(round(RADIUS / spacing)):
        radius = (layer + 0.5) * spacing
        count = round(2.0 * math.pi * radius / spacing)
        angle = 2.0 * math.pi * (np.arange(count) + 0.37 * layer) / count
        points.append(radius * np.column_stack([np.cos(angle), 0.0 * angle, np.sin(angle)]))
    return np.concatenate(points)


def turning(fluid: Fluid) -> float:
    """Angular momentum about y, of particles of one mass [m2/s]."""
    (x, _, z), (u, _, w) = fluid.state.position.astype(float), fluid.state.velocity.astype(float)
    return float((z * u - x * w).sum())


@pytest.mark.parametrize(("layers", "most"), [(8, 0.3), (16, 0.15)])
def test_a_round_bucket_keeps_its_angular_momentum(make_fluid, layers: int, most: float) -> None:
    """It lost 0.87 omega^2 dt a second at any spacing; what is left falls with the spacing."""
    omega, time_step, duration = 2.0, 0.02, 3.0
    fluid = round_fluid(make_fluid, RADIUS / layers, True, discs(RADIUS / layers), maximum_time_step=time_step)
    x, _, z = fluid.state.position
    fluid.state.velocity[:] = omega * np.stack([z, 0.0 * x, -x])
    fluid.advance(0.2)
    before = turning(fluid)
    steps = sum(fluid.advance(0.2).sub_steps for _ in range(round(duration / 0.2)))
    rate = -math.log(turning(fluid) / before) / duration
    assert rate < most * omega**2 * duration / steps


def test_a_stream_keeps_more_of_its_momentum_round_a_pile(make_fluid) -> None:
    """By theory a pile without friction takes none; what it takes falls by a third and more."""
    spacing, time_step = 0.1, 0.04
    points = block((-1.5, 0, -1.5), (1.5, 0, 1.5), spacing, 2)
    points = points[np.hypot(points[:, 0], points[:, 2]) > RADIUS + 0.45 * spacing]
    square, angle = points[:, 0] ** 2 + points[:, 2] ** 2, np.arctan2(points[:, 2], points[:, 0])
    dipole = RADIUS**2 / square
    kept = []
    for curved in (False, True):
        fluid = round_fluid(
            make_fluid, spacing, False, points, curved, periodic=(True, False, True), maximum_time_step=time_step
        )
        fluid.state.velocity[:] = np.stack([1.0 - dipole * np.cos(2 * angle), 0 * angle, -dipole * np.sin(2 * angle)])
        start = fluid.state.velocity[0].mean(dtype=float)
        fluid.advance(3.0)
        kept.append(fluid.state.velocity[0].mean(dtype=float) / start)
    assert 1.0 - kept[1] < 0.7 * (1.0 - kept[0])
