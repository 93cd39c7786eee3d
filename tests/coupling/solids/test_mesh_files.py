"""Mesh files as they come: damaged ones are refused in words, foreign encodings and scenes are read."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh

from coupling.solids.bodies import MESH_SUFFIXES, box, load_mesh, load_solid, read_mesh_file


def written(folder: Path, suffix: str) -> bytes:
    box((1.0, 2.0, 3.0)).export(folder / f"whole{suffix}")
    return (folder / f"whole{suffix}").read_bytes()


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
def test_a_file_cut_anywhere_is_refused_by_its_name(tmp_path: Path, suffix: str) -> None:
    data, path = written(tmp_path, suffix), tmp_path / f"cut{suffix}"
    for length in range(0, len(data.rstrip()) - 1, max(1, len(data) // 40)):
        path.write_bytes(data[:length])
        with pytest.raises(ValueError, match=f"cut{suffix} ") as refused:
            load_solid(path)
        assert len(str(refused.value)) < 600 and "\n" not in str(refused.value)


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
def test_a_file_with_wrong_bytes_is_read_or_refused_by_its_name(tmp_path: Path, suffix: str) -> None:
    data, path, random = written(tmp_path, suffix), tmp_path / f"odd{suffix}", np.random.default_rng(0)
    for _ in range(150):
        damaged = bytearray(data)
        for at in random.integers(0, len(data), size=random.integers(1, 9)):
            damaged[at] = random.integers(0, 256)
        path.write_bytes(damaged)
        try:
            solid = load_solid(path)
        except ValueError as refused:
            assert str(refused).startswith(f"mesh {path} ")
        else:
            assert solid.volume > 0.0 and solid.mesh.is_watertight


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("empty.stl", b"", "cannot be read: the file is empty"),
        (
            "text.stl",
            b"This is no mesh at all.\n" * 20,
            "cannot be read: it is no STL file, neither in text nor in binary",
        ),
        ("facetless.stl", b"solid nothing\nendsolid nothing\n", "cannot be read: it is no STL file"),
        (
            "long.stl",
            bytes(80) + struct.pack("<I", 1) + bytes(150),
            "it has 234 bytes, and a binary STL of 1 triangles",
        ),
        ("other.glb", b"no mesh at all" * 4, "it does not begin as a GLB file does"),
        ("old.glb", b"glTF" + struct.pack("<II", 1, 20) + bytes(20), "it is a GLB of version 1, allowed: 2"),
        ("lines.obj", b"v 0 0 0\nv 1 0 0\nl 1 2\n", "holds no triangles, allowed"),
        ("nan.obj", b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "has 1 corners that are no finite numbers"),
        ("far.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "it is damaged, cut short or no OBJ file"),
    ],
)
def test_files_that_hold_no_mesh_are_refused(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=f"{name} .*{message}"):
        load_solid(tmp_path / name)


def test_a_compressed_glb_is_refused_by_its_compression(tmp_path: Path) -> None:
    header = json.dumps({"asset": {"version": "2.0"}, "extensionsRequired": ["KHR_draco_mesh_compression"]}).encode()
    chunk = struct.pack("<I4s", len(header), b"JSON") + header
    (tmp_path / "small.glb").write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(chunk)) + chunk)
    with pytest.raises(
        ValueError, match="triangles are compressed by KHR_draco_mesh_compression, allowed: an uncompressed"
    ):
        load_solid(tmp_path / "small.glb")


def test_names_and_comments_may_be_in_any_encoding(tmp_path: Path) -> None:
    head = "# Größe\nmtllib gr\xf6\xdfe.mtl\no Gr\xf6\xdfe\nusemtl gr\xfcn\n"
    for encoding, start in (("latin-1", b""), ("utf-8", b"\xef\xbb\xbf")):
        (tmp_path / "hull.obj").write_bytes(start + head.encode(encoding) + written(tmp_path, ".obj"))
        assert load_mesh(tmp_path / "hull.obj").volume == pytest.approx(6.0)
    text = box((1.0, 2.0, 3.0)).export(file_type="stl_ascii").replace("solid", "solid Gr\xf6\xdfe", 1)
    (tmp_path / "hull.stl").write_bytes(text.encode("latin-1"))
    assert load_mesh(tmp_path / "hull.stl").volume == pytest.approx(6.0, rel=1e-6)
    data = written(tmp_path, ".ply").replace(b"comment ", "comment Gr\xf6\xdfe ".encode("latin-1"), 1)
    (tmp_path / "hull.ply").write_bytes(data)
    assert load_mesh(tmp_path / "hull.ply").volume == pytest.approx(6.0)


def test_scenes_are_put_together_with_their_transforms(tmp_path: Path) -> None:
    scene, mirror, shift = trimesh.Scene(), np.diag((-1.0, 1.0, 1.0, 1.0)), np.eye(4)
    mirror[0, 3], shift[:3, 3] = 3.0, (0.5, 0.0, 0.0)
    scene.add_geometry(box((1.0, 1.0, 1.0)), transform=shift)
    scene.add_geometry(box((1.0, 1.0, 1.0)), transform=mirror)
    scene.add_geometry(box((1.0, 1.0, 1.0)))
    scene.export(tmp_path / "scene.glb")
    assert len(read_mesh_file(tmp_path / "scene.glb")) == 3
    solid = load_solid(tmp_path / "scene.glb")
    assert solid.volume == pytest.approx(2.5, rel=1e-6)
    np.testing.assert_allclose(solid.mesh.bounds[:, 0], (-0.5, 3.5), atol=1e-6)


def test_a_mesh_far_from_the_origin_of_its_file_is_told(tmp_path: Path) -> None:
    box((3.0, 3.0, 3.0)).apply_translation((1e6, 0.0, 0.0)).export(tmp_path / "far.stl")
    with pytest.warns(UserWarning, match=r"far\.stl: it lies 1e\+06 m from its origin, where numbers of 32 bits"):
        assert load_mesh(tmp_path / "far.stl").volume == pytest.approx(27.0)
