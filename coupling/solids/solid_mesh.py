"""Reads a mesh as a solid, from which its mass, its wall particles and the space free of liquid follow.

A mesh is sorted into closed shells (`closed_shells`). Each shell lies in others or in none:

    a shell in none, or in a hollow       bounds matter, whichever way it is wound
    a shell in matter, wound inwards      bounds a sealed hollow
    a shell in matter, wound outwards     adds nothing: a part that lies in another

Shells that pass through each other are joined, so that matter that they share counts once (exact Boolean operations of `manifold3d`).
The `notes` tell what was mended; faults that cannot be mended are refused, with their place. All arithmetic runs on a copy of size 1 about
the origin, so that neither the unit nor the place of a mesh matters.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import trimesh

from coupling.solids.closed_shells import Shell, UnitFrame, closed_shells
from coupling.solids.shell_nesting import Nest, PlacedShell, nested_shells
from coupling.solids.signed_distance import SignedDistance
from oilsim.backend.arrays import Array, Flags, Ints

COARSE = 1e-3  # of a mesh's size: steps of 32-bit numbers at its place, from which it is told that they bend it


@dataclass(frozen=True, kw_only=True, eq=False)
class SolidMesh:
    """A solid: matter between closed shells that neither cross nor touch.

    Attributes:
        mesh: surface of the matter, hollows included, with normals out of the matter [m].
        outer: the surface that surrounding liquid meets: `mesh` without sealed hollows and the matter in them; `mesh` itself if there are
            none [m].
        notes: a sentence on each thing that was mended, to follow "mesh ...: ".
    """

    mesh: trimesh.Trimesh
    outer: trimesh.Trimesh
    notes: tuple[str, ...] = ()

    @property
    def volume(self) -> float:
        """Volume of the matter [m3]."""
        return float(self.mesh.volume)

    @property
    def displaced_volume(self) -> float:
        """Volume of matter and sealed hollows [m3]."""
        return float(self.outer.volume)

    @property
    def has_hollow(self) -> bool:
        """True if there are sealed hollows."""
        return self.outer is not self.mesh

    def signed_distance(self, points: Array) -> Array:
        """Return the distance (K,) [m] of points (K, 3) [m] to the matter's surface, below 0 in matter."""
        return self._field.phi(points)

    def contains(self, points: Array) -> Flags:
        """Mark (K,) the points (K, 3) [m] that lie in matter."""
        return self.signed_distance(points) < 0.0

    @cached_property
    def _field(self) -> SignedDistance:
        return SignedDistance(self.mesh)


def read_solid(mesh: trimesh.Trimesh, what: str = "mesh") -> SolidMesh:
    """Read a mesh as a solid; a sound mesh is kept as it is, as the same object.

    Raises TypeError for anything but a mesh, and ValueError for a mesh that is no solid and cannot be mended; messages begin with `what`.
    """
    if not isinstance(mesh, trimesh.Trimesh):
        raise TypeError(f"{what} is of the type {type(mesh).__name__}, allowed: trimesh.Trimesh")
    return read_objects([mesh], what)


def told_solid(mesh: trimesh.Trimesh, what: str = "mesh", *, stacklevel: int = 3) -> SolidMesh:
    """Read a mesh as a solid, as `read_solid` does; a warning tells the caller's caller what was mended."""
    solid = read_solid(mesh, what)
    if solid.notes:
        warnings.warn(f"{what}: {'; '.join(solid.notes)}", stacklevel=stacklevel)
    return solid


def read_objects(objects: Sequence[trimesh.Trimesh], what: str) -> SolidMesh:
    """Read the objects of a file as one solid; ValueError, which begins with `what`, if they are none and cannot be mended.

    Corners of different objects are joined if that closes the surface, else each object is closed by itself.
    """
    whole = objects[0] if len(objects) == 1 else trimesh.util.concatenate(list(objects))
    _require_numbers(whole, what)
    try:
        try:
            return _read(whole, [np.asarray(whole.faces, dtype=np.int64)])
        except ValueError:
            if len(objects) == 1:
                raise
            starts = np.cumsum([0, *(len(part.vertices) for part in objects)])
            return _read(whole, [np.asarray(part.faces) + start for part, start in zip(objects, starts, strict=False)])
    except ValueError as cause:
        raise ValueError(f"{what} {cause}") from cause


def _require_numbers(mesh: trimesh.Trimesh, what: str) -> None:
    """Refuse a mesh without triangles, and corners that are no finite numbers or all lie in one place; ValueError."""
    if len(mesh.faces) == 0:
        raise ValueError(f"{what} holds no triangles, allowed: a closed surface of triangles")
    strange = np.flatnonzero(~np.isfinite(mesh.vertices).all(axis=1))
    if strange.size:
        raise ValueError(
            f"{what} has {strange.size} corners that are no finite numbers, the first is number {strange[0]}, "
            f"{np.asarray(mesh.vertices)[strange[0]].tolist()}, allowed: finite numbers"
        )
    if not np.ptp(np.asarray(mesh.vertices)[np.asarray(mesh.faces).ravel()], axis=0).max() > 0.0:
        raise ValueError(f"{what} has all its corners in one place, allowed: a closed surface")


def _read(whole: trimesh.Trimesh, parts: Sequence[Ints]) -> SolidMesh:
    """Read the shells of all parts and nest them; errors and notes come without the mesh's name."""
    vertices = np.asarray(whole.vertices, dtype=np.float64)
    used = vertices[np.unique(np.concatenate(parts))]
    frame = UnitFrame.of(used)
    unit = frame.unit(vertices)
    notes, shells = _coarse(frame), list[Shell]()
    for faces in parts:
        found = closed_shells(unit, faces, frame)
        shells += found.shells
        notes += found.notes
    nest = nested_shells([PlacedShell(unit, shell.faces, shell.volume) for shell in shells], frame)
    notes += nest.notes
    if _is_sound(whole, shells, nest):
        return SolidMesh(mesh=whole, outer=whole, notes=tuple(notes))
    mesh = _joined(nest.shells, vertices, frame)
    outer = mesh if nest.is_massive else _joined(nest.outer, vertices, frame)
    return SolidMesh(mesh=mesh, outer=outer, notes=tuple(notes))


def _coarse(frame: UnitFrame) -> list[str]:
    """Tell of a place so far from the origin that 32-bit numbers, as files hold, cannot draw the mesh."""
    away = float(np.abs(frame.middle).max())
    step = float(np.spacing(np.float32(away)))
    if step <= COARSE * frame.size:
        return []
    return [
        f"it lies {away:.3g} m from its origin, where numbers of 32 bits, as most files hold, are {step:.2g} m apart, and is "
        f"{frame.size:.3g} m large; moved to its origin before it is written, it would keep its shape"
    ]


def _is_sound(whole: trimesh.Trimesh, shells: Sequence[Shell], nest: Nest) -> bool:
    """Tell whether the mesh can be kept as it is: nothing was mended, and shells share no corners."""
    if not nest.is_untouched or not nest.is_massive or any(shell.is_mended for shell in shells):
        return False
    corners = [np.unique(shell.faces) for shell in shells]
    if sum(len(own) for own in corners) != len(whole.vertices) or len(np.unique(np.concatenate(corners))) != len(
        whole.vertices
    ):
        return False
    return sum(len(shell.faces) for shell in shells) == len(whole.faces)


def _joined(shells: Sequence[PlacedShell], vertices: Array, frame: UnitFrame) -> trimesh.Trimesh:
    """Join shells into one mesh, in the original place and unit, without shared corners; the mesh's own corners keep their coordinates."""
    corners, faces, start = list[Array](), list[Ints](), 0
    for shell in shells:
        used, index = np.unique(shell.faces, return_inverse=True)
        own = vertices[used] if shell.is_original else frame.back(shell.vertices[used])
        corners.append(own)
        faces.append(index.reshape(-1, 3) + start)
        start += len(used)
    return trimesh.Trimesh(np.concatenate(corners), np.concatenate(faces), process=False)
