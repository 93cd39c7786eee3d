"""Sorts shells into those that bound matter, those that bound hollows and those that add nothing; shared matter counts once.

`solid_mesh` gives the rule. Every shell is compared with the shells whose boxes touch its own. A shell lies in another if nothing of it is
left when the other is cut away.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from coupling.solids.closed_shells import UnitFrame, counted
from oilsim.backend.arrays import Array, Flags, Ints

NOTHING = 1e-9  # of a shell's volume, or of its area^(3/2): what rounding leaves
TOUCH = 1e-9  # how far boxes of unit size may lie apart that touch
NAMED = 5  # places of parts that are told, at most


@dataclass(frozen=True, eq=False)
class PlacedShell:
    """A closed shell, in the dimensionless units of a `UnitFrame`.

    Attributes:
        vertices: (V, 3), of which the faces use some.
        faces: (F, 3) corners, indices of vertices.
        volume: signed volume, above 0 if the normals point out of the shell.
        is_original: true if the vertices are those of the mesh, false if joining made them.
    """

    vertices: Array
    faces: Ints
    volume: float
    is_original: bool = True

    @property
    def corners(self) -> Array:
        """Vertices (K, 3) that the faces use."""
        return self.vertices[np.unique(self.faces)]

    def inverted(self) -> PlacedShell:
        """Return the shell wound the other way."""
        return replace(self, faces=self.faces[:, ::-1], volume=-self.volume)


@dataclass(frozen=True, eq=False)
class Nest:
    """Shells of a solid, normals out of matter.

    Attributes:
        shells: shells that bound matter, and those that bound hollows, which have a volume below 0.
        outer: shells that bound matter and do not lie in a hollow.
        is_untouched: true if these are the shells as they were given.
        notes: a sentence on each thing that was mended.
    """

    shells: tuple[PlacedShell, ...]
    outer: tuple[PlacedShell, ...]
    is_untouched: bool
    notes: tuple[str, ...]

    @property
    def is_massive(self) -> bool:
        """True if there are no hollows."""
        return len(self.outer) == len(self.shells)


def nested_shells(shells: Sequence[PlacedShell], frame: UnitFrame) -> Nest:
    """Nest shells given in the units of `frame`; ValueError for shells that cannot be joined."""
    by_size = sorted(shells, key=lambda shell: -abs(shell.volume))
    meeting = _meeting(by_size)
    containers = _containers(by_size, meeting)
    kept, notes = _oriented(by_size, containers, frame)
    turned = [by_size[n].inverted() if is_turned else by_size[n] for n, is_turned in kept.items()]
    result, joined = _united(turned, list(kept), meeting, containers, frame)
    notes += joined
    return Nest(tuple(result), tuple(_outside(result)), not notes, tuple(notes))


def _places(frame: UnitFrame, shells: Sequence[PlacedShell]) -> str:
    """Say where shells lie."""
    more = f" and {len(shells) - NAMED} more" if len(shells) > NAMED else ""
    return f"about {', '.join(frame.place(shell.corners) for shell in shells[:NAMED])} m{more}"


def _meeting(shells: Sequence[PlacedShell]) -> Flags:
    """Mark the pairs (S, S) of shells whose boxes touch."""
    low = np.array([shell.corners.min(axis=0) for shell in shells]) - 0.5 * TOUCH
    high = np.array([shell.corners.max(axis=0) for shell in shells]) + 0.5 * TOUCH
    meet = np.ones((len(shells), len(shells)), dtype=bool)
    for axis in range(3):
        meet &= low[:, None, axis] <= high[None, :, axis]
    return meet & meet.T


def _containers(shells: Sequence[PlacedShell], meeting: Flags) -> list[list[int]]:
    """List for each shell the shells that it lies in, the smallest last; `shells` are ordered by size, the largest first."""
    found: list[list[int]] = [[] for _ in shells]
    low = np.array([shell.corners.min(axis=0) for shell in shells])
    high = np.array([shell.corners.max(axis=0) for shell in shells])
    for n, shell in enumerate(shells):
        for other in np.flatnonzero(meeting[n, :n]).tolist():
            if (low[n] < low[other] - TOUCH).any() or (high[n] > high[other] + TOUCH).any():
                continue
            if _lies_in(shell, shells[other]):
                found[n].append(other)
    return found


def _lies_in(shell: PlacedShell, other: PlacedShell) -> bool:
    """Tell whether nothing is left of a shell when another is cut away."""
    rest = _manifold(shell) - _manifold(other)
    return bool(rest.volume() <= NOTHING * abs(shell.volume))


def _oriented(
    shells: Sequence[PlacedShell], containers: Sequence[Sequence[int]], frame: UnitFrame
) -> tuple[dict[int, bool], list[str]]:
    """Return the shells to keep, by their number, with true if the shell must be turned inside out; and notes."""
    winding, turned = [0] * len(shells), [False] * len(shells)
    kept, inwards, within, twice = dict[int, bool](), list[PlacedShell](), list[PlacedShell](), list[PlacedShell]()
    for n, shell in enumerate(shells):
        parent = containers[n][-1] if containers[n] else None
        around = 0 if parent is None else winding[parent]
        turned[n] = parent is not None and turned[parent]
        if parent is not None and abs(shells[parent].volume) - abs(shell.volume) <= NOTHING * abs(shell.volume):
            winding[n] = winding[parent]
            twice.append(shell)
            continue
        sign = (1 if shell.volume > 0.0 else -1) * (-1 if turned[n] else 1)
        if around <= 0 and sign < 0:
            turned[n], sign = not turned[n], 1
            inwards.append(shell)
        winding[n] = around + sign
        if (around, winding[n]) in ((0, 1), (1, 0)):
            kept[n] = turned[n]
        else:
            within.append(shell)
    texts = {
        f"{counted(len(inwards), 'part')} wound inwards turned outwards, {{}}": inwards,
        f"{counted(len(twice), 'part')} there twice left out, {{}}": twice,
        f"{counted(len(within), 'part')} inside another left out, {{}} (a hollow would be wound inwards)": within,
    }
    return kept, [text.format(_places(frame, found)) for text, found in texts.items() if found]


def _united(
    shells: Sequence[PlacedShell],
    numbers: Sequence[int],
    meeting: Flags,
    containers: Sequence[Sequence[int]],
    frame: UnitFrame,
) -> tuple[list[PlacedShell], list[str]]:
    """Join shells that pass through or touch each other; return all shells, and a note if any were joined."""
    crossing = meeting[np.ix_(numbers, numbers)].copy()
    np.fill_diagonal(crossing, False)
    for k, number in enumerate(numbers):
        for other in containers[number]:
            if other in numbers:
                crossing[k, numbers.index(other)] = crossing[numbers.index(other), k] = False
    if not crossing.any():
        return list(shells), []
    joined = _material(shells, numbers, containers)
    area = sum(_area(shell) for shell in shells)
    volume, united = sum(shell.volume for shell in shells), sum(shell.volume for shell in joined)
    if abs(sum(_area(shell) for shell in joined) - area) <= NOTHING * area and abs(volume - united) <= NOTHING * abs(
        volume
    ):
        return list(shells), []
    involved = [shell for shell, is_joined in zip(shells, np.any(crossing, axis=1).tolist(), strict=True) if is_joined]
    overlap = (
        f"; their overlap of {frame.volume(volume - united)} counts once" if volume - united > NOTHING * volume else ""
    )
    text = f"{counted(len(involved), 'part')} that overlap or touch joined to one solid, {_places(frame, involved)}{overlap}"
    return joined, [text]


def _material(
    shells: Sequence[PlacedShell], numbers: Sequence[int], containers: Sequence[Sequence[int]]
) -> list[PlacedShell]:
    """Return the shells of the union of all solids; each solid is an outer shell less its own hollows."""
    from manifold3d import Manifold, OpType  # only here: few meshes need it

    hollows: dict[int, list[int]] = {k: [] for k, shell in enumerate(shells) if shell.volume > 0.0}
    for k, number in enumerate(numbers):
        if shells[k].volume < 0.0:
            outers = [numbers.index(other) for other in containers[number] if other in numbers]
            hollows[[one for one in outers if one in hollows][-1]].append(k)
    solids = [
        Manifold.batch_boolean([_manifold(shells[k]), *(_manifold(shells[h]) for h in own)], OpType.Subtract)
        for k, own in hollows.items()
    ]
    united = Manifold.batch_boolean(solids, OpType.Add).to_mesh64()
    return _split(np.asarray(united.vert_properties)[:, :3].copy(), np.asarray(united.tri_verts, dtype=np.int64))


def _manifold(shell: PlacedShell):  # type: ignore[no-untyped-def]
    """Turn a shell, wound outwards, into a `Manifold` for Boolean operations; ValueError if they cannot use it."""
    from manifold3d import Error, Manifold, Mesh64

    outwards = shell if shell.volume > 0.0 else shell.inverted()
    used, index = np.unique(outwards.faces, return_inverse=True)
    made = Manifold(Mesh64(np.ascontiguousarray(shell.vertices[used]), index.reshape(-1, 3).astype(np.uint64)))
    if made.status() != Error.NoError or made.is_empty():
        raise ValueError(
            f"has a part of {len(shell.faces)} triangles that cannot be joined with others: {made.status().name}"
        )
    return made


def _split(vertices: Array, faces: Ints) -> list[PlacedShell]:
    """Split a surface into its connected shells, without crumbs that rounding leaves."""
    rows = np.repeat(faces[:, 0], 2)
    graph = coo_array((np.ones(len(rows)), (rows, faces[:, 1:].ravel())), shape=(len(vertices),) * 2)
    label = connected_components(graph, directed=False)[1][faces[:, 0]]
    shells = []
    for part in np.unique(label):
        own = faces[label == part]
        a, b, c = np.moveaxis(vertices[own], 1, 0)
        shell = PlacedShell(vertices, own, float(np.einsum("fi,fi->", a, np.cross(b, c))) / 6.0, is_original=False)
        if abs(shell.volume) > NOTHING * _area(shell) ** 1.5:
            shells.append(shell)
    return shells


def _area(shell: PlacedShell) -> float:
    a, b, c = np.moveaxis(shell.vertices[shell.faces], 1, 0)
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def _outside(shells: Sequence[PlacedShell]) -> list[PlacedShell]:
    """Select the shells of matter that do not lie in a hollow."""
    hollows = [shell for shell in shells if shell.volume < 0.0]
    return [
        shell
        for shell in shells
        if shell.volume > 0.0
        and not any(abs(hollow.volume) > shell.volume and _lies_in(shell, hollow) for hollow in hollows)
    ]
