"""One reading of meshes: what is mended, what is refused, and that volume, inside and walls agree whatever the mesh is made of."""

from __future__ import annotations

import itertools
import math
import re
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pybullet_data
import pytest
import trimesh

from coupling.solids.bodies import box, mass_properties, mesh_parts, sphere
from coupling.solids.closed_shells import crossing_triangles
from coupling.solids.hydrostatics import hydrostatics
from coupling.solids.solid_mesh import SolidMesh, read_objects, read_solid
from coupling.solids.surface_sampling import sample_surface

Array = npt.NDArray[np.float64]
Vector = tuple[float, float, float]


def cube(edge: float = 1.0, at: Vector = (0.0, 0.0, 0.0)) -> trimesh.Trimesh:
    return box((edge, edge, edge)).apply_translation(at)


def inwards(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.faces[:, ::-1], process=False)


def together(*parts: trimesh.Trimesh, merged: bool = False) -> trimesh.Trimesh:
    mesh = trimesh.util.concatenate(list(parts))
    if merged:
        mesh.merge_vertices()
    return mesh


def soup(mesh: trimesh.Trimesh, noise: float = 0.0) -> trimesh.Trimesh:
    """Triangles that share no corners, as an STL file holds them."""
    corners = mesh.triangles.reshape(-1, 3) + noise * np.random.default_rng(0).normal(size=(3 * len(mesh.faces), 3))
    return trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)


def with_faces(mesh: trimesh.Trimesh, faces: npt.NDArray) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, faces, process=False)


def some_turned() -> trimesh.Trimesh:
    faces = cube().faces.copy()
    faces[[3, 7]] = faces[[3, 7], ::-1]
    return with_faces(cube(), faces)


def with_bulkhead() -> trimesh.Trimesh:
    """A box of 2 x 1 x 1 with a wall of two triangles, drawn from both sides, across its middle."""
    return together(cube(1.0, (-0.5, 0, 0)), cube(1.0, (0.5, 0, 0)), merged=True)


def frame_of_beams() -> trimesh.Trimesh:
    """Six slabs that together close a hollow of 0.8^3 in a cube of 1.2."""
    slabs = []
    for axis, side in itertools.product(range(3), (-0.5, 0.5)):
        size, place = [1.2, 1.2, 1.2], [0.0, 0.0, 0.0]
        size[axis], place[axis] = 0.2, side
        slabs.append(box((size[0], size[1], size[2])).apply_translation(place))
    return together(*slabs)


SOUND = {
    "box": (cube(), 1.0),
    "ball": (sphere(0.5), math.pi / 6.0),
    "torus": (trimesh.creation.torus(1.0, 0.3), None),
    "two apart": (together(cube(), cube(1.0, (2, 0, 0))), 2.0),
}

# mesh, volume of the matter, volume with sealed hollows, notes
MENDED = {
    "corners of its own for each triangle": (soup(cube()), 1.0, 1.0, []),
    "gaps of rounding": (soup(sphere(0.5), 1e-7), math.pi / 6.0, math.pi / 6.0, [r"corners up to 1e-06 m apart joined"]),
    "all inwards": (inwards(cube()), 1.0, 1.0, ["1 part wound inwards turned outwards"]),
    "some triangles inwards": (some_turned(), 1.0, 1.0, ["2 triangles wound against the neighbours turned over"]),
    "one part inwards": (
        together(cube(), inwards(cube(0.5, (2, 0, 0)))), 1.125, 1.125, [r"1 part wound inwards .* about \(2, 0, 0\) m"]
    ),
    "parts overlap": (together(cube(), cube(1.0, (0.5, 0, 0))), 1.5, 1.5, [r"2 parts that overlap .* overlap of 0\.5 m3"]),
    "parts overlap, one inwards": (
        together(cube(), inwards(cube(1.0, (0.5, 0, 0)))), 1.5, 1.5, ["1 part wound inwards", "2 parts that overlap"]
    ),
    "parts touch along a face": (together(cube(), cube(1.0, (1, 0, 0))), 2.0, 2.0, ["overlap or touch joined"]),
    "parts touch along part of a face": (together(cube(), cube(0.5, (0.75, 0, 0))), 1.125, 1.125, ["or touch joined"]),
    "parts share a face's corners": (with_bulkhead(), 2.0, 2.0, ["overlap or touch joined"]),
    "parts share a face's corners, one inwards": (
        together(cube(), inwards(cube(1.0, (1, 0, 0))), merged=True), 2.0, 2.0, ["1 part wound inwards", "joined to one"]
    ),
    "parts share an edge": (together(cube(), cube(1.0, (1, 1, 0)), merged=True), 2.0, 2.0, []),
    "parts share a corner": (together(cube(), cube(1.0, (1, 1, 1)), merged=True), 2.0, 2.0, []),
    "a part twice": (together(cube(), cube()), 1.0, 1.0, ["1 part there twice left out"]),
    "a part twice, once inwards": (together(cube(), inwards(cube())), 1.0, 1.0, ["1 part there twice left out"]),
    "a triangle twice": (
        with_faces(cube(), np.concatenate([cube().faces, cube().faces[:1]])), 1.0, 1.0, ["1 double triangle left out"]
    ),
    "a triangle without area": (with_faces(cube(), np.concatenate([cube().faces, [[0, 0, 1]]])), 1.0, 1.0, []),
    "a hollow": (together(cube(), inwards(cube(0.5))), 0.875, 1.0, []),
    "a hollow, all inside out": (together(inwards(cube()), cube(0.5)), 0.875, 1.0, ["1 part wound inwards"]),
    "a part in a part": (together(cube(), cube(0.5)), 1.0, 1.0, ["1 part inside another left out"]),
    "a float in a hollow": (together(cube(), inwards(cube(0.5)), cube(0.25)), 0.875 + 0.25**3, 1.0, []),
    "a float in a hollow, inwards": (
        together(cube(), inwards(cube(0.5)), inwards(cube(0.25))), 0.875 + 0.25**3, 1.0, ["1 part wound inwards"]
    ),
    "a hollow float in a hollow": (
        together(cube(), inwards(cube(0.8)), cube(0.6), inwards(cube(0.4))), 1.0 - 0.512 + 0.216 - 0.064, 1.0, []
    ),
    "hollows overlap": (
        together(cube(2.0), inwards(cube()), inwards(cube(1.0, (0.4, 0.4, 0)))), 8.0 - 1.64, 8.0, ["overlap or touch"]
    ),
    "a mast through a hollow": (
        together(cube(2.0), inwards(cube()), box((0.2, 0.2, 3.0))), 7.0 + 0.04 + 0.04, 8.04, ["3 parts that overlap"]
    ),
    "slabs that close a hollow": (frame_of_beams(), 1.2**3 - 0.8**3, 1.2**3, ["6 parts that overlap"]),
}  # fmt: skip


def folded() -> trimesh.Trimesh:
    """A ball whose cap is pushed through its bottom."""
    vertices = sphere(1.0).vertices.copy()
    vertices[vertices[:, 2] > 0.8, 2] -= 2.5
    return trimesh.Trimesh(vertices, sphere(1.0).faces, process=False)


def klein_bottle(count: int = 24) -> trimesh.Trimesh:
    turn = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    u, v = np.meshgrid(turn, turn, indexing="ij")
    radius = 2.0 + np.cos(u / 2) * np.sin(v) - np.sin(u / 2) * np.sin(2 * v)
    height = np.sin(u / 2) * np.sin(v) + np.cos(u / 2) * np.sin(2 * v)
    points = np.stack([radius * np.cos(u), radius * np.sin(u), height], axis=-1).reshape(-1, 3)

    def number(i: int, j: int) -> int:
        return (i % count) * count + (-j if i == count else j) % count

    faces = []
    for i, j in itertools.product(range(count), range(count)):
        a, b, c, d = number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)
        faces += [[a, b, c], [a, c, d]]
    return trimesh.Trimesh(points, faces, process=False)


def finned() -> trimesh.Trimesh:
    """A cube with a fin without thickness, drawn from both sides."""
    body = cube()
    edge = np.flatnonzero((body.vertices[:, 0] > 0) & (body.vertices[:, 2] > 0))
    fin = np.array([[edge[0], edge[1], 8]])
    return trimesh.Trimesh(
        [*body.vertices, (0.5, 0.0, 2.0)], np.concatenate([body.faces, fin, fin[:, ::-1]]), process=False
    )


def open_bulkhead() -> trimesh.Trimesh:
    """A box of 2 x 1 x 1 with a wall of two triangles, drawn from one side, across its middle."""
    half = cube(1.0, (0.5, 0, 0))
    on_wall = (np.abs(half.vertices[half.faces][:, :, 0]) < 1e-9).all(axis=1)
    return together(cube(1.0, (-0.5, 0, 0)), with_faces(half, half.faces[~on_wall]), merged=True)


NOT_A_NUMBER = trimesh.Trimesh([*cube().vertices[:7], (0.5, math.nan, 0.5)], cube().faces, process=False)
REFUSED = {
    "a hole": (with_faces(cube(), cube().faces[1:]), "mesh is not watertight: 3 edges do not join exactly two triangles"),
    "a wall inside, drawn once": (open_bulkhead(), "mesh is not watertight: 4 edges do not join exactly two triangles"),
    "a sheet": (trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), "mesh is not watertight"),
    "a sheet from both sides": (
        trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [2, 1, 0]], process=False), "encloses no volume"
    ),
    "a fin": (finned(), r"mesh has a part of 2 triangles about \(0\.5, 0, 1\.25\) m that encloses no volume, allowed"),
    "it crosses itself": (folded(), r"mesh crosses itself about \(.*\) m: two triangles of one part pass through"),
    "one side only": (klein_bottle(), "mesh has a side that turns into its own back"),
    "no number": (NOT_A_NUMBER, r"mesh has 1 corners that are no finite numbers, the first is number 7, \[0\.5, nan"),
    "nothing": (trimesh.Trimesh(), "mesh holds no triangles, allowed"),
    "a point": (trimesh.Trimesh(np.zeros((3, 3)), [[0, 1, 2]], process=False), "has all its corners in one place"),
    "a line": (trimesh.Trimesh([[0, 0, 0], [1, 0, 0]], [[0, 1, 1]], process=False), "encloses no volume: all its"),
}  # fmt: skip


def counted_volume(solid: SolidMesh, count: int = 40_000) -> tuple[float, float]:
    """Volume by points that the solid contains, and its standard deviation."""
    low, high = solid.mesh.bounds
    points = np.random.default_rng(3).uniform(low, high, size=(count, 3))
    share, whole = float(solid.contains(points).mean()), float(np.prod(high - low))
    return share * whole, whole * math.sqrt(max(share * (1.0 - share), 1e-4) / count)


@pytest.mark.parametrize(("mesh", "volume"), SOUND.values(), ids=SOUND.keys())
def test_sound_meshes_are_kept_as_they_are(mesh: trimesh.Trimesh, volume: float | None) -> None:
    solid = read_solid(mesh)
    assert solid.mesh is mesh and solid.outer is mesh and solid.notes == ()
    assert volume is None or solid.volume == pytest.approx(volume, rel=1e-9)


@pytest.mark.parametrize(("mesh", "volume", "displaced", "notes"), MENDED.values(), ids=MENDED.keys())
def test_meshes_are_mended_and_told(mesh: trimesh.Trimesh, volume: float, displaced: float, notes: list[str]) -> None:
    solid = read_solid(mesh)
    assert solid.mesh.is_watertight and solid.mesh.is_winding_consistent
    assert solid.volume == pytest.approx(volume, rel=1e-6)
    assert solid.displaced_volume == pytest.approx(displaced, rel=1e-6)
    assert len(solid.notes) == len(notes)
    assert all(re.search(note, text) for note, text in zip(notes, solid.notes, strict=True)), solid.notes
    found, deviation = counted_volume(solid)
    assert abs(found - volume) < 4.0 * deviation
    # under water by far, it displaces what its outer surface holds
    assert hydrostatics(solid.outer, 10.0).displaced_volume == pytest.approx(displaced, rel=1e-6)


@pytest.mark.parametrize(("mesh", "message"), REFUSED.values(), ids=REFUSED.keys())
def test_meshes_that_are_no_solids_are_refused_with_their_place(mesh: trimesh.Trimesh, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read_solid(mesh)


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1.0, 1e3, 1e6])
@pytest.mark.parametrize(
    "name", ["parts overlap, one inwards", "a hollow float in a hollow", "parts share a face's corners"]
)
def test_neither_unit_nor_place_matters(name: str, scale: float) -> None:
    mesh, volume, _, notes = MENDED[name]
    place = np.array((3e5, -1e6, 2e5)) * scale
    moved = trimesh.Trimesh(mesh.vertices * scale + place, mesh.faces, process=False)
    solid = read_solid(moved)
    own = mass_properties(solid, density=1.0)
    assert own.mass / scale**3 == pytest.approx(volume, rel=1e-8)
    there = mass_properties(read_solid(mesh), density=1.0)
    np.testing.assert_allclose(own.center_of_mass, there.center_of_mass * scale + place, atol=1e-8 * scale)
    np.testing.assert_allclose(own.inertia / scale**5, there.inertia, rtol=1e-6, atol=1e-7)
    points = np.random.default_rng(5).uniform(*mesh.bounds, size=(2000, 3))
    phi = read_solid(mesh).signed_distance(points)
    np.testing.assert_allclose(solid.signed_distance(points * scale + place) / scale, phi, atol=1e-7)
    assert len(solid.notes) == len(notes) + 1 and "numbers of 32 bits" in solid.notes[0]


@pytest.mark.parametrize("seed", range(6))
def test_random_heaps_agree_with_their_formula(seed: int) -> None:
    """Boxes and balls in any relation to each other: the union, as each point's membership says, is what all answers give."""
    random = np.random.default_rng(seed)
    count = int(random.integers(2, 7))
    centers, radii = random.uniform(-0.6, 0.6, size=(count, 3)), random.uniform(0.15, 0.6, size=count)
    balls = random.random(count) < 0.4
    parts = [
        (trimesh.creation.icosphere(subdivisions=3, radius=r) if is_ball else cube(2.0 * r)).apply_translation(c)
        for c, r, is_ball in zip(centers, radii, balls, strict=True)
    ]
    turned = random.random(count) < 0.3
    if any((np.abs(a - b).max() < r) for k, (a, r) in enumerate(zip(centers, radii, strict=True)) for b in centers[:k]):
        turned[:] = False  # a part inwards that lies in another would be a hollow
    solid = read_solid(together(*(inwards(part) if turn else part for part, turn in zip(parts, turned, strict=True))))
    low, high = solid.mesh.bounds
    points = random.uniform(low, high, size=(40_000, 3))
    distance = np.full(len(points), np.inf)
    for center, radius, is_ball in zip(centers, radii, balls, strict=True):
        offset = points - center
        own = np.linalg.norm(offset, axis=1) - radius if is_ball else np.abs(offset).max(axis=1) - radius
        distance = np.minimum(distance, own)
    clear = np.abs(distance) > 0.01  # a polyhedron of a ball is up to a hundredth smaller
    np.testing.assert_array_equal(solid.contains(points)[clear], distance[clear] < 0.0)
    found, deviation = counted_volume(solid)
    assert abs(found - solid.volume) < 4.0 * deviation
    assert mass_properties(solid, density=2.0).mass == pytest.approx(2.0 * solid.volume)


@pytest.mark.parametrize("name", ["parts overlap", "one part inwards", "a hollow", "parts share a face's corners"])
def test_walls_stand_for_the_volume(name: str) -> None:
    """No part is deeper than two spacings, so that the two layers of walls stand for all matter."""
    mesh, volume, _, _ = MENDED[name]
    solid = read_solid(mesh)
    sampling = sample_surface(solid.mesh, 0.25)
    assert float(sampling.volume.sum()) == pytest.approx(volume, rel=0.03)
    assert (solid.signed_distance(sampling.position) < 0.0).all()
    assert float(sampling.area.sum()) == pytest.approx(solid.mesh.area, rel=0.02)


def test_parts_that_were_joined_are_read_again_as_they_are() -> None:
    """The union of these hulls has triangles 1e-7 high, beside which edges pass that do not cross them."""
    joined = read_objects(mesh_parts(Path(pybullet_data.getDataPath()) / "teddy2_VHACD_CHs.obj"), "teddy").mesh
    again = read_solid(joined)
    assert again.mesh is joined and again.notes == ()


@pytest.mark.parametrize(("beside", "crosses"), [(1e-8, False), (-1e-8, True), (0.0, True)])
def test_edge_crosses_a_triangle_only_if_it_passes_within_its_borders(beside: float, crosses: bool) -> None:
    """The other triangle's edge passes through the plane of the first, at this distance outside of its longest side."""
    first = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.5, 1.0, 0.0)]
    other = [(0.5, -beside, -0.5), (0.5, -beside, 0.5), (0.5, -1.0, 0.0)]
    found = crossing_triangles(np.array([*first, *other]), np.arange(6).reshape(2, 3))
    assert (found is not None) == crosses
