"""Wall points from meshes: exact distances, even layers at their depths, kernel sums and gradients against integrals."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest
import trimesh
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from coupling.solids.bodies import box, capsule, cylinder, sphere
from coupling.solids.signed_distance import SignedDistance
from coupling.solids.surface_sampling import PITCH, SurfaceSampling, particles_of, sample_surface
from coupling.solids.thin_parts import HELD
from oilsim.neighborhood.smoothing_kernels import SUPPORT, kernel, lattice, normalisation

Array = npt.NDArray[np.float64]
SIGMA = normalisation(1.0, 3)
DENSER = 0.88 / PITCH**2  # points on d^2: of points chosen at random some lie farther apart


def moved(mesh: trimesh.Trimesh, angles: tuple[float, float, float]) -> trimesh.Trimesh:
    """A copy turned and shifted, so that nothing lies along a lattice."""
    transform = np.eye(4)
    transform[:3, :3], transform[:3, 3] = Rotation.from_euler("xyz", angles).as_matrix(), (0.123, -0.456, 0.789)
    copy = mesh.copy()
    copy.apply_transform(transform)
    return copy


def ell() -> trimesh.Trimesh:
    """An L of two boxes: one concave edge."""
    outline = np.array([[0, 0], [8, 0], [8, 4], [4, 4], [4, 8], [0, 8]], dtype=float)
    bottom = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])
    sides = [[i, (i + 1) % 6, 6 + i] for i in range(6)] + [[(i + 1) % 6, 6 + (i + 1) % 6, 6 + i] for i in range(6)]
    vertices = np.concatenate([np.column_stack([outline, np.full(6, z)]) for z in (0.0, 5.0)])
    return trimesh.Trimesh(vertices, np.concatenate([bottom[:, ::-1], bottom + 6, sides]))


def wedge() -> trimesh.Trimesh:
    """A sharp bow: 10 long, half an opening of 11 degrees."""
    outline = np.array([[0, 0], [10, -2], [10, 2]], dtype=float)
    vertices = np.concatenate([np.column_stack([outline, np.full(3, z)]) for z in (0.0, 6.0)])
    faces = [[0, 2, 1], [3, 4, 5], [0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4], [2, 0, 5], [0, 3, 5]]
    return trimesh.Trimesh(vertices, faces)


SHAPES = {
    "box": box((7.0, 6.0, 5.0)),
    "sphere": sphere(4.0, 4),
    "cylinder": cylinder(3.0, 6.0),
    "capsule": capsule(2.0, 5.0),
    "concave": ell(),
}


def test_distance_to_a_box_is_exact_inside_and_outside() -> None:
    points = np.random.default_rng(1).uniform(-3.0, 3.0, (3000, 3))
    beyond = np.abs(points) - np.array([0.5, 1.0, 1.5])
    expected = np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0)
    solid = SignedDistance(box((1.0, 2.0, 3.0)))
    np.testing.assert_allclose(solid.phi(points), expected, atol=1e-12)
    step = 1e-6
    gradient = np.stack(
        [(solid.phi(points + s) - solid.phi(points - s)) / (2 * step) for s in np.eye(3) * step], axis=1
    )
    smooth = np.abs(np.linalg.norm(gradient, axis=1) - 1.0) < 1e-6
    assert smooth.mean() > 0.99
    np.testing.assert_allclose(solid.phi_and_outward(points)[1][smooth], gradient[smooth], atol=1e-4)


def test_of_several_parts_the_deepest_counts_wherever_a_point_lies() -> None:
    corners = np.random.default_rng(2).uniform(-1.0, 1.0, (12, 3))
    parts = [box((0.5, 0.8, 0.3)).apply_translation(corner) for corner in corners]
    points = np.random.default_rng(3).uniform(-2.0, 2.0, (3000, 3))
    alone = np.stack([SignedDistance(part).phi(points) for part in parts])
    union = SignedDistance(trimesh.util.concatenate(parts))
    assert union.is_union
    np.testing.assert_allclose(union.phi(points), alone.min(axis=0), atol=1e-12)


def test_sign_is_right_at_a_concave_edge_and_a_sharp_one() -> None:
    # inside and outside by an independent winding number
    for mesh in (ell(), wedge()):
        low, high = mesh.bounds
        points = np.random.default_rng(2).uniform(low - 1.0, high + 1.0, (400, 3))
        a, b, c = (mesh.triangles[None, :, k] - points[:, None] for k in range(3))
        la, lb, lc = (np.linalg.norm(v, axis=2) for v in (a, b, c))
        volume = np.einsum("kfi,kfi->kf", a, np.cross(b, c))
        scale = la * lb * lc + (a * b).sum(2) * lc + (b * c).sum(2) * la + (c * a).sum(2) * lb
        winding = np.arctan2(volume, scale).sum(axis=1) / (2.0 * math.pi)
        np.testing.assert_array_equal(SignedDistance(mesh).phi(points) < 0.0, winding > 0.5)


def test_lattice_finds_every_point_of_a_shell() -> None:
    # the shell r1 <= r <= r2 of a sphere holds 4/3 pi (r2^3 - r1^3) / h^3 lattice points
    points, phi = SignedDistance(sphere(1.0, 4)).lattice(0.04, -0.2, 0.1)
    assert len(points) == pytest.approx(4.0 / 3.0 * math.pi * (1.1**3 - 0.8**3) / 0.04**3, rel=0.01)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1) - 1.0, phi, atol=2e-3)


@pytest.mark.parametrize("name", SHAPES)
def test_layers_lie_at_their_depths_and_evenly(name: str) -> None:
    mesh = moved(SHAPES[name], (0.3, 0.5, -0.7))
    sampling = sample_surface(mesh, 1.0)
    solid = SignedDistance(mesh)
    outer, inner = sampling.position[: sampling.outer], sampling.position[sampling.outer :]
    np.testing.assert_allclose(sampling.depth, -solid.phi(sampling.position))
    # centroids of curved cells lie a little off the middle of their shell
    np.testing.assert_allclose(sampling.depth[: sampling.outer], 0.5, atol=0.15)
    np.testing.assert_allclose(sampling.depth[sampling.outer :], 1.5, atol=0.3)
    for points in (outer, inner):
        nearest = cKDTree(points).query(points, 2)[0][:, 1]
        assert nearest.mean() == pytest.approx(PITCH, rel=0.12)
        assert nearest.min() > 0.6 * PITCH
    assert sampling.excess_volume == 0.0
    # no hole that a particle fits through: every place of the layer has a point near by
    places, _ = solid.lattice(0.25, -0.6, -0.4)
    assert cKDTree(outer).query(places)[0].max() < PITCH


@pytest.mark.parametrize("name", SHAPES)
def test_points_stand_for_the_volume_its_first_moment_and_the_area(name: str) -> None:
    mesh = moved(SHAPES[name], (0.3, 0.5, -0.7))
    sampling = sample_surface(mesh, 1.0)
    particles = particles_of(name, sampling, no_slip=True)
    assert particles.name == name and particles.no_slip
    assert particles.area.sum() == pytest.approx(mesh.area, rel=1e-9)
    assert (particles.area[sampling.outer :] == 0.0).all() and (particles.area[: sampling.outer] > 0.0).all()
    points, phi = SignedDistance(mesh).lattice(0.1, -2.05, 0.05)
    weight = np.clip(0.5 - phi / 0.1, 0.0, 1.0) * np.clip(0.5 + (phi + 2.0) / 0.1, 0.0, 1.0) * 0.1**3
    assert particles.volume.sum() == pytest.approx(weight.sum(), rel=5e-3)
    center = weight @ points / weight.sum()
    np.testing.assert_allclose(particles.volume @ particles.position / particles.volume.sum(), center, atol=0.02)


def test_number_of_points_in_each_shell() -> None:
    # more by DENSER than a lattice has: n^3 - (n - 2)^3 in the outer shell of a cube, (n - 2)^3 - (n - 4)^3 in the next
    sampling = sample_surface(box((8.0, 8.0, 8.0)), 1.0)
    assert sampling.outer == pytest.approx(DENSER * (8**3 - 6**3), rel=0.1)
    assert len(sampling.position) - sampling.outer == pytest.approx(DENSER * (6**3 - 4**3), rel=0.1)
    # of a ball about the area of each layer, 4 pi (R - 1/2)^2 and 4 pi (R - 3/2)^2
    sampling = sample_surface(sphere(5.0, 4), 1.0)
    assert sampling.outer == pytest.approx(DENSER * 4.0 * math.pi * 4.5**2, rel=0.05)
    assert len(sampling.position) - sampling.outer == pytest.approx(DENSER * 4.0 * math.pi * 3.5**2, rel=0.05)


def test_plate_of_two_spacings_has_no_inner_layer_and_one_of_three_has() -> None:
    assert sample_surface(box((9.0, 8.0, 2.0)), 1.0).outer == len(sample_surface(box((9.0, 8.0, 2.0)), 1.0).position)
    sampling = sample_surface(box((9.0, 8.0, 3.0)), 1.0)
    inner = sampling.position[sampling.outer :]
    assert len(inner) == pytest.approx(DENSER * 7 * 6, rel=0.1)
    np.testing.assert_allclose(inner[:, 2], 0.0, atol=0.02)


def test_sampling_scales() -> None:
    # a shape a tenth the size sampled with a tenth the spacing is the same
    large, small = sample_surface(box((5.0, 4.0, 3.0)), 1.0), sample_surface(box((0.5, 0.4, 0.3)), 0.1)
    assert len(small.position) == pytest.approx(len(large.position), rel=0.05)
    assert 1e3 * small.volume.sum() == pytest.approx(large.volume.sum(), rel=1e-2)


def kernel_sums(sampling: SurfaceSampling, probes: Array) -> tuple[Array, Array]:
    """sum V W (K,) and sum V grad W (K, 3) of the wall points at probes."""
    arm = probes[:, None] - sampling.position[None]
    q = np.linalg.norm(arm, axis=2) / SUPPORT
    slope = slope_of(q) / SUPPORT**2 * sampling.volume
    return kernel_of(q) @ sampling.volume, np.einsum("kb,kbi->ki", slope, arm)


def kernel_of(q: Array) -> Array:
    """W at q = r / H, spacing 1."""
    rest = np.maximum(1.0 - q, 0.0)
    return np.asarray(SIGMA * rest**4 * (1.0 + 4.0 * q))


def slope_of(q: Array) -> Array:
    """(dW/dq) / q at q = r / H, spacing 1."""
    return np.asarray(-20.0 * SIGMA * np.maximum(1.0 - q, 0.0) ** 3)


def kernel_integrals(solid: SignedDistance, probes: Array) -> tuple[Array, Array]:
    """Integrals of W (K,) and grad W (K, 3) over the solid, by a lattice of step 1/8 about each probe."""
    step = 0.125
    offset = lattice(step, 3) + 0.5 * step
    offset = offset[np.linalg.norm(offset, axis=1) < SUPPORT]
    q = np.linalg.norm(offset, axis=1) / SUPPORT
    slope = -slope_of(q)[:, None] / SUPPORT**2 * offset
    filled = np.stack([np.clip(0.5 - solid.phi(probe + offset) / step, 0.0, 1.0) for probe in probes])
    return filled @ kernel_of(q) * step**3, filled @ slope * step**3


def probes_outside(solid: SignedDistance, distance: float, count: int) -> Array:
    """Random places at a distance from the surface: none that the sampling knows."""
    points, _ = solid.lattice(0.2, distance - 0.1, distance + 0.1)
    points = points[np.random.default_rng(3).choice(len(points), count, replace=False)]
    for _ in range(5):
        points = points + (distance - solid.phi(points))[:, None] * solid.phi_and_outward(points)[1]
    return points


def kernel_sum(points: Array) -> float:
    return float(kernel(np.linalg.norm(points, axis=1) / SUPPORT, SIGMA).sum())


def half_space_integral(distance: float) -> float:
    """The integral of the kernel beyond a plane."""
    step = 1.0 / 16.0
    points = lattice(step, 3) + 0.5 * step
    return kernel_sum(points[points[:, 2] < -distance]) * step**3


def wall_factor() -> float:
    """c = lattice sum over integral of the kernel beyond a plane half a spacing away."""
    points = lattice(1.0, 3)
    return kernel_sum(points[points[:, 2] < -0.5]) / half_space_integral(0.5)


def slope_factor() -> float:
    """c' = lattice sum over integral of the normal gradient beyond a plane half a spacing away."""
    points = lattice(1.0, 3)
    below = points[points[:, 2] < -0.5]
    q = np.linalg.norm(below, axis=1) / SUPPORT
    total = float((slope_of(q) * -below[:, 2]).sum() / SUPPORT**2)
    return total / ((half_space_integral(0.5625) - half_space_integral(0.4375)) / 0.125)


UNSEEN = {
    "box": box((7.3, 6.1, 5.4)),
    "ellipsoid": sphere(1.0, 3).apply_scale((5.0, 3.5, 3.0)),
    "torus": trimesh.creation.torus(major_radius=5.0, minor_radius=2.2),
    "capsule": capsule(2.7, 5.0),
    "hexagonal prism": cylinder(3.4, 6.2, sections=6),
    "roof": trimesh.Trimesh([[0, 0, 0], [8, 0, 0], [4, 0, 4], [0, 9, 0], [8, 9, 0], [4, 9, 4]]).convex_hull,
    "concave": ell(),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", UNSEEN)
def test_liquid_sees_as_much_of_the_solid_and_its_gradient_as_of_a_lattice(name: str) -> None:
    mesh = moved(UNSEEN[name], (0.4, -0.2, 0.9))
    solid = SignedDistance(mesh)
    sampling = sample_surface(mesh, 1.0)
    probes = probes_outside(solid, 0.5, 100)
    share, gradient = kernel_sums(sampling, probes)
    share_expected, gradient_expected = kernel_integrals(solid, probes)
    # in parts of what a flat wall shows: in front of a sharp edge there is little to be seen. Places are random, while liquid settles
    # where it sees less, between the points
    error = (share / wall_factor() - share_expected) / half_space_integral(0.5)
    assert 0.01 < error.mean() < 0.025
    assert math.sqrt(np.mean(error**2)) < 0.035
    flat = (half_space_integral(0.4375) - half_space_integral(0.5625)) / 0.125
    miss = (gradient / slope_factor() - gradient_expected) / flat
    along = (miss * gradient_expected).sum(axis=1) / np.linalg.norm(gradient_expected, axis=1)
    assert abs(along.mean()) < 0.02
    assert math.sqrt(np.mean((miss**2).sum(axis=1))) < 0.05


@pytest.mark.parametrize("thickness", [0.02, 0.3, 0.8])
def test_thin_plate_gets_one_layer_on_its_middle_plane(thickness: float) -> None:
    sampling = sample_surface(box((10.0, 8.0, thickness)), 1.0)
    assert np.abs(sampling.position[:, 2]).max() < 0.02 * thickness
    assert (np.abs(sampling.position[:, :2]) <= np.array([4.53, 3.53])).all() or thickness > 0.5
    np.testing.assert_allclose(sampling.depth, 0.5 * thickness, rtol=0.03)
    # counted once, though the plate has two faces: between those that its middle plane of 63 has room for and those of a lattice, 80
    assert sampling.outer == len(sampling.position) == pytest.approx(DENSER * 72, rel=0.15)
    assert sampling.area.sum() == pytest.approx(160.0 + 36.0 * thickness)
    # seen by particles it is one spacing thick, its rim unmoved but rounded: slab, half rods along the rim, corners
    swollen = 63.0 + 32.0 * math.pi / 8.0 + math.pi / 6.0
    assert sampling.volume.sum() == pytest.approx(swollen, rel=0.06)
    assert sampling.excess_volume + 80.0 * thickness == pytest.approx(swollen, rel=0.12)


@pytest.mark.parametrize("thickness", [0.3, 0.9, 1.0, 1.1])
def test_a_plate_of_a_held_solid_counts_as_thick_enough_to_be_tight(thickness: float) -> None:
    """Its volume grows by what it is thickened, but for its rim; plates that are tight, and thick solids, stay as they are."""
    mesh = box((10.0, 10.0, thickness))
    sampling = sample_surface(mesh, 1.0, minimum_thickness=HELD)
    assert (10.0 - HELD) ** 2 < sampling.excess_volume / (HELD - thickness) < 10.0**2
    assert sampling.volume.sum() == pytest.approx(mesh.volume + sampling.excess_volume, rel=0.05)
    for tight in (1.25, 4.0):
        wide, own = box((10.0, 10.0, tight)), sample_surface(box((10.0, 10.0, tight)), 1.0)
        np.testing.assert_array_equal(sample_surface(wide, 1.0, minimum_thickness=HELD).volume, own.volume)


def test_plate_too_thin_for_two_sheets_has_one_that_zigzags() -> None:
    sampling = sample_surface(box((10.0, 8.0, 1.5)), 1.0)
    height = sampling.position[(np.abs(sampling.position[:, :2]) < 3.0).all(axis=1), 2]
    assert np.abs(height).max() < 0.45
    assert height.mean() == pytest.approx(0.0, abs=0.1)
    assert len(sampling.position) < 1.7 * 80
    assert sampling.volume.sum() == pytest.approx(120.0, rel=0.01)


@pytest.mark.parametrize("shape", ["wedge", "rod"])
def test_tips_and_rods_are_covered_and_nothing_lies_outside(shape: str) -> None:
    mesh = wedge() if shape == "wedge" else box((10.0, 0.3, 0.3))
    sampling = sample_surface(mesh, 1.0)
    solid = SignedDistance(mesh)
    assert solid.phi(sampling.position).max() < 1e-6
    inside, _ = solid.lattice(0.1, -10.0, -0.01)
    assert cKDTree(sampling.position).query(inside)[0].max() < (1.5 if shape == "rod" else 3.0)
    tip = sampling.position[:, 0].min() - mesh.bounds[0, 0]
    assert tip < 1.1


def test_float_with_a_skirt_is_sampled_as_thick_and_thin() -> None:
    # a boom's section: a float 2 thick on a skirt 0.2 thin
    float_, skirt = box((6.0, 2.0, 2.0)), box((6.0, 0.2, 5.0))
    skirt.apply_translation((0.0, 0.0, -2.5 + 0.9))
    mesh = trimesh.util.concatenate([float_, skirt])
    sampling = sample_surface(mesh, 1.0)
    low = sampling.position[:, 2] < -1.6
    assert low.sum() >= 8
    assert np.abs(sampling.position[low, 1]).max() < 0.01
    np.testing.assert_allclose(sampling.depth[sampling.position[:, 2] > 0.0], 0.5, atol=0.1)


def test_what_cannot_be_sampled_is_refused() -> None:
    with pytest.raises(ValueError, match=r"particle_spacing is 0\.0 m, allowed: above 0"):
        sample_surface(box((1.0, 1.0, 1.0)), 0.0)
    with pytest.raises(ValueError, match=r"minimum_thickness is 2\.0 m, allowed: 0 to 1\.3 particle spacings"):
        sample_surface(box((9.0, 9.0, 9.0)), 1.0, minimum_thickness=2.0)
    with pytest.raises(ValueError, match=r"too small for particles of 1\.0 m"):
        sample_surface(box((0.1, 0.1, 0.1)), 1.0)


@pytest.mark.parametrize(
    ("mesh", "axes"),
    [
        (trimesh.creation.cylinder(0.3, 1.0), [(0.0, 0.0, 1.0)]),
        (trimesh.creation.icosphere(3, 0.3), np.eye(3)),
        (trimesh.creation.box((0.6, 0.6, 1.0)), []),
        (trimesh.creation.icosphere(4, 0.3).apply_scale((1.0, 1.05, 1.2)), []),
    ],
    ids=["cylinder", "ball", "box", "ellipsoid"],
)
def test_solids_of_revolution_know_their_axes(mesh: trimesh.Trimesh, axes: list) -> None:
    """About the axis of a cylinder that is off the origin, and about any of a ball, a turn leaves the surface where it is."""
    off = np.array((0.2, -0.1, 0.0))
    turns = sample_surface(mesh.copy().apply_translation(off), 0.05).turns
    assert len(turns) == len(axes)
    np.testing.assert_allclose(turns[:, :3], np.cross(off, turns[:, 3:]), atol=1e-6)
    np.testing.assert_allclose(
        turns[:, 3:].T @ turns[:, 3:],
        np.diag(np.sum(np.square(axes), axis=0)) if len(axes) else np.zeros((3, 3)),
        atol=1e-6,
    )
