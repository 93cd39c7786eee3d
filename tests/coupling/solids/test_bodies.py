"""Meshes from files and primitives, and their mass properties against closed forms."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from coupling.solids.bodies import (
    MassProperties,
    about_center_of_mass,
    box,
    capsule,
    cylinder,
    load_mesh,
    mass_properties,
    sphere,
)


@pytest.mark.parametrize("suffix", [".stl", ".obj", ".ply", ".glb"])
def test_mesh_survives_a_file(tmp_path: Path, suffix: str) -> None:
    mesh = box((1.0, 2.0, 3.0))
    mesh.apply_translation((0.1, 0.2, 0.3))
    mesh.export(tmp_path / f"box{suffix}")
    loaded = load_mesh(tmp_path / f"box{suffix}", scale=0.5)
    assert loaded.volume == pytest.approx(6.0 / 8.0, rel=1e-6)
    np.testing.assert_allclose(mass_properties(loaded, density=2.0).center_of_mass, (0.05, 0.1, 0.15), atol=1e-7)


def test_mesh_turned_inside_out_is_mended(tmp_path: Path) -> None:
    mesh = sphere(1.0)
    mesh.invert()
    mesh.export(tmp_path / "hollow.ply")
    assert load_mesh(tmp_path / "hollow.ply").volume == pytest.approx(4.0 / 3.0 * math.pi, rel=1e-6)


def test_bad_mesh_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"nowhere\.stl does not exist"):
        load_mesh(tmp_path / "nowhere.stl")
    with pytest.raises(ValueError, match=r"kind '\.step', allowed: \.stl, \.obj, \.ply, \.glb"):
        load_mesh(tmp_path / "hull.step")
    (tmp_path / "noise.ply").write_text("no mesh at all")
    with pytest.raises(ValueError, match=r"noise\.ply"):
        load_mesh(tmp_path / "noise.ply")
    opened = box((1.0, 1.0, 1.0))
    opened.update_faces(np.arange(11))
    opened.export(tmp_path / "opened.stl")
    with pytest.raises(ValueError, match=r"opened\.stl is not watertight: 3 edges"):
        load_mesh(tmp_path / "opened.stl")
    with pytest.raises(ValueError, match=r"scale of mesh .* is 0\.0, allowed: above 0"):
        load_mesh(tmp_path / "opened.stl", scale=0.0)


def test_box_inertia() -> None:
    # I_x = m (b^2 + c^2) / 12
    properties = mass_properties(box((1.0, 2.0, 3.0)), density=500.0)
    assert properties.mass == pytest.approx(3000.0)
    np.testing.assert_allclose(properties.inertia, np.diag([3250.0, 2500.0, 1250.0]), atol=1e-8)


def test_round_shapes_have_their_exact_volume_and_nearly_their_inertia() -> None:
    ball = mass_properties(sphere(0.5), mass=10.0)
    # I = 2/5 m r^2; the polyhedron of equal volume differs by the second order of its facets
    np.testing.assert_allclose(ball.inertia, np.eye(3) * 0.4 * 10.0 * 0.25, rtol=2e-3, atol=1e-9)
    assert float(sphere(0.5).volume) == pytest.approx(math.pi / 6.0)
    # I_z = m r^2 / 2, I_x = m (3 r^2 + h^2) / 12
    drum = mass_properties(cylinder(0.3, 0.8), mass=7.0)
    expected = np.diag([7.0 * (3 * 0.09 + 0.64) / 12.0] * 2 + [7.0 * 0.045])
    np.testing.assert_allclose(drum.inertia, expected, rtol=1e-3, atol=1e-9)
    assert float(cylinder(0.3, 0.8).volume) == pytest.approx(math.pi * 0.09 * 0.8)
    pill = capsule(0.2, 0.6)
    assert float(pill.volume) == pytest.approx(math.pi * 0.04 * (0.6 + 0.8 / 3.0))
    np.testing.assert_allclose(mass_properties(pill, mass=1.0).center_of_mass, 0.0, atol=1e-12)
    np.testing.assert_allclose(pill.bounds[:, 2], (-0.5, 0.5), atol=1e-12)


def test_inertia_of_a_turned_and_moved_body() -> None:
    # I' = R I R^T about the same centre of mass, wherever the mesh lies
    turn = Rotation.from_euler("xyz", (0.3, -0.7, 1.1)).as_matrix()
    mesh = box((1.0, 2.0, 3.0))
    transform = np.eye(4)
    transform[:3, :3], transform[:3, 3] = turn, (5.0, -4.0, 3.0)
    mesh.apply_transform(transform)
    properties = mass_properties(mesh, density=1.0)
    np.testing.assert_allclose(properties.inertia, turn @ np.diag([6.5, 5.0, 2.5]) @ turn.T, atol=1e-9)
    np.testing.assert_allclose(properties.center_of_mass, (5.0, -4.0, 3.0), atol=1e-12)
    moments, axes = properties.principal_axes()
    np.testing.assert_allclose(moments, (2.5, 5.0, 6.5), atol=1e-9)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    np.testing.assert_allclose(axes @ np.diag(moments) @ axes.T, properties.inertia, atol=1e-9)
    centered = about_center_of_mass(mesh, properties)
    np.testing.assert_allclose(centered.center_mass, 0.0, atol=1e-12)
    np.testing.assert_allclose(mesh.center_mass, (5.0, -4.0, 3.0), atol=1e-12)


@pytest.mark.parametrize(
    ("mass", "inertia", "message"),
    [
        (0.0, np.eye(3), "mass is 0.0 kg, allowed: above 0"),
        (math.nan, np.eye(3), "mass is nan kg"),
        (1.0, np.diag([1.0, 1.0, 3.0]), "more than the sum of the others"),
        (1.0, np.diag([1.0, 1.0, -1.0]), "principal moment -1.0"),
        (1.0, np.eye(2), "a finite 3 x 3 matrix"),
        (1.0, np.eye(3) + np.triu(np.ones((3, 3)), 1) * 0.1, "not symmetric"),
    ],
)
def test_impossible_mass_properties_are_refused(mass: float, inertia: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        MassProperties(mass=mass, center_of_mass=np.zeros(3), inertia=inertia)


def test_density_and_mass_exclude_each_other() -> None:
    for arguments in ({}, {"mass": 1.0, "density": 1.0}):
        with pytest.raises(ValueError, match="exactly one of them"):
            mass_properties(box((1.0, 1.0, 1.0)), **arguments)
    with pytest.raises(ValueError, match=r"density is -1\.0, allowed: above 0"):
        mass_properties(box((1.0, 1.0, 1.0)), density=-1.0)
    with pytest.raises(ValueError, match=r"box size is 1\.0, 0\.0, 1\.0 m"):
        box((1.0, 0.0, 1.0))
    with pytest.raises(ValueError, match="not watertight"):
        mass_properties(trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), mass=1.0)
