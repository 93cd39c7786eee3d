"""Wall points from meshes: exact distances, points at their depth and evenly spread, kernel shares against integrals."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from coupling.bodies import box, capsule, cylinder, sphere
from coupling.signed_distance import SignedDistance
from coupling.surface_sampling import SurfaceSampling, particles_of, sample_surface
from oilsim.boundary import SAMPLING, half_space_integral, lattice_wall_factor
from oilsim.smoothing_kernels import SUPPORT, kernel, normalisation


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
    "box": (box((6.0, 5.0, 4.0)), 24.0 * 2 + 20.0 * 2 + 30.0 * 2),
    "sphere": (sphere(4.0, 4), None),
    "cylinder": (cylinder(3.0, 6.0), None),
    "capsule": (capsule(2.0, 5.0), None),
    "concave": (ell(), None),
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
    np.testing.assert_allclose(solid.outward(points)[smooth], gradient[smooth], atol=1e-4)


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
def test_points_lie_half_a_spacing_deep_and_evenly(name: str) -> None:
    mesh = moved(SHAPES[name][0], (0.3, 0.5, -0.7))
    sampling = sample_surface(mesh, 1.0)
    solid = SignedDistance(mesh)
    np.testing.assert_allclose(solid.phi(sampling.position), -0.5, atol=0.011)
    np.testing.assert_allclose(solid.phi(sampling.probe), 0.5, atol=0.01)
    nearest = cKDTree(sampling.position).query(sampling.position, 2)[0][:, 1]
    assert nearest.std() / nearest.mean() < 0.1
    assert nearest.min() > 0.4
    assert math.sqrt(sampling.area / len(sampling.position)) == pytest.approx(SAMPLING, rel=0.02)
    assert sampling.excess_volume == 0.0
    # no hole: every place of the layer has a point near by
    places, _ = solid.lattice(0.25, -0.6, -0.4)
    assert cKDTree(sampling.position).query(places)[0].max() < 0.75


def test_area_of_the_layer_of_a_sphere_and_a_box() -> None:
    # spheres and boxes shrink by half a spacing: 4 pi (R - d/2)^2, and edges a - d
    assert sample_surface(sphere(4.0, 4), 1.0).area == pytest.approx(4.0 * math.pi * 3.5**2, rel=0.02)
    assert sample_surface(box((6.0, 5.0, 4.0)), 1.0).area == pytest.approx(2.0 * (5 * 4 + 4 * 3 + 5 * 3), rel=0.02)


def test_share_in_front_of_a_flat_wall_is_that_of_a_half_space() -> None:
    mesh = moved(box((9.0, 9.0, 5.0)), (0.3, 0.5, -0.7))
    sampling = sample_surface(mesh, 1.0)
    local = (sampling.probe - mesh.centroid) @ Rotation.from_euler("xyz", (0.3, 0.5, -0.7)).as_matrix()
    flat = (np.abs(local[:, :2]) < 2.5).all(axis=1) & (np.abs(local[:, 2]) > 2.9)
    assert flat.sum() > 50
    np.testing.assert_allclose(sampling.share[flat], half_space_integral(0.5, 3), rtol=0.02)


def sphere_share(radius: float) -> float:
    """Kernel integral (spacing 1) over a sphere, from 1/2 outside: shells about the probe, the part of a shell of radius s
    inside the sphere is a cap with cos(angle) >= (s^2 + D^2 - R^2) / (2 s D)."""
    distance, sigma = radius + 0.5, normalisation(1.0, 3)
    shell = (np.arange(4000) + 0.5) * SUPPORT / 4000
    cosine = np.clip((shell**2 + distance**2 - radius**2) / (2.0 * shell * distance), -1.0, 1.0)
    weight = np.array([kernel(s / SUPPORT, sigma) for s in shell])
    return float((weight * 2.0 * math.pi * (1.0 - cosine) * shell**2).sum() * SUPPORT / 4000)


@pytest.mark.parametrize("radius", [1.5, 3.0, 6.0])
def test_share_in_front_of_a_sphere(radius: float) -> None:
    sampling = sample_surface(sphere(radius, 4), 1.0)
    np.testing.assert_allclose(sampling.share, sphere_share(radius), rtol=0.02)


def test_share_scales_away() -> None:
    # gamma has no unit: a shape a tenth the size sampled with a tenth the spacing is the same
    large, small = sample_surface(box((5.0, 4.0, 3.0)), 1.0), sample_surface(box((0.5, 0.4, 0.3)), 0.1)
    assert len(small.position) == pytest.approx(len(large.position), rel=0.02)
    np.testing.assert_allclose(
        np.quantile(small.share, (0.1, 0.5, 0.9)), np.quantile(large.share, (0.1, 0.5, 0.9)), rtol=0.05
    )


@pytest.mark.parametrize("thickness", [0.02, 0.3, 0.8])
def test_thin_plate_gets_one_layer_on_its_middle_plane(thickness: float) -> None:
    sampling = sample_surface(box((10.0, 8.0, thickness)), 1.0)
    assert np.abs(sampling.position[:, 2]).max() < 0.02 * thickness
    assert (np.abs(sampling.position[:, :2]) <= np.array([4.53, 3.53])).all() or thickness > 0.5
    np.testing.assert_allclose(sampling.depth, 0.5 * thickness, rtol=0.03)
    # counted once, though the plate has two faces: 9 x 7 of middle plane
    assert len(sampling.position) == pytest.approx(63.0 / SAMPLING**2, rel=0.08)
    # seen by particles it is one spacing thick, its rim unmoved but rounded: slab, half rods along the rim, corners
    swollen = 63.0 + 32.0 * math.pi / 8.0 + math.pi / 6.0
    np.testing.assert_allclose(np.abs(sampling.probe[:, 2]), 1.0, atol=0.05)
    assert sampling.excess_volume + 80.0 * thickness == pytest.approx(swollen, rel=0.12)


def test_plate_twice_as_thick_as_its_layers_has_two() -> None:
    sampling = sample_surface(box((10.0, 8.0, 1.5)), 1.0)
    height = sampling.position[:, 2]
    assert set(np.round(height[(np.abs(sampling.position[:, :2]) < 3.0).all(axis=1)], 2)) == {-0.25, 0.25}


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
    assert low.sum() > 20
    assert np.abs(sampling.position[low, 1]).max() < 0.01
    np.testing.assert_allclose(sampling.depth[sampling.position[:, 2] > 0.0], 0.5, atol=0.011)


def coverage(sampling: SurfaceSampling, volume: np.ndarray, points: np.ndarray) -> np.ndarray:
    support, sigma = SUPPORT * sampling.particle_spacing, normalisation(sampling.particle_spacing, 3)
    distance = np.linalg.norm(points[:, None] - sampling.position[None], axis=2)
    q = np.minimum(distance / support, 1.0)
    weight = sigma * (1.0 - q) ** 4 * (1.0 + 4.0 * q)
    return weight @ volume


@pytest.mark.parametrize("radius", [2.0, 4.0])
def test_volumes_stand_for_the_solid_all_around_a_sphere(radius: float) -> None:
    # checked at places that were no probes
    sampling = sample_surface(sphere(radius, 4), 1.0)
    particles = particles_of("ball", sampling, no_slip=True)
    assert particles.name == "ball" and particles.no_slip
    direction = np.random.default_rng(3).normal(size=(200, 3))
    places = (radius + 0.5) * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    expected = lattice_wall_factor(3) * sphere_share(radius)
    covered = coverage(sampling, particles.volume, places)
    assert covered.mean() == pytest.approx(expected, rel=0.01)
    assert covered.std() < 0.02 * expected


def test_what_cannot_be_sampled_is_refused() -> None:
    with pytest.raises(ValueError, match=r"particle_spacing is 0\.0 m, allowed: above 0"):
        sample_surface(box((1.0, 1.0, 1.0)), 0.0)
    with pytest.raises(ValueError, match=r"minimum_thickness is 2\.0 m, allowed: 0 to the particle spacing"):
        sample_surface(box((9.0, 9.0, 9.0)), 1.0, minimum_thickness=2.0)
    with pytest.raises(ValueError, match=r"too small for particles of 1\.0 m"):
        sample_surface(box((0.1, 0.1, 0.1)), 1.0)
