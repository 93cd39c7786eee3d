"""Shapes by which a vessel is drawn: her hull, deck and wheelhouse in their colours. No computation sees these shapes."""

from __future__ import annotations

import numpy as np
import trimesh
from numpy.typing import NDArray

from coupling.solids.bodies import tube
from recordings.model import palette
from recordings.model.frame import Color, MeshDescription
from vessels.hull import Hull

# all proportions of a workboat here are chosen, for looks
STATIONS = np.array(
    [-1.0, -1.0, -0.7, -0.3, 0.0, 0.25, 0.45, 0.6, 0.75, 0.87, 0.95, 1.0]
)  # in half lengths; the first closes the stern
PARALLEL = 0.1  # part of the half length ahead of midships from which the sides run together
BOTTOM = 0.7  # breadth of the bottom, in that of the deck
SHEER = 0.3  # height of the stem over the deck amidships, in depths
STEM_RAKE = 0.1  # by which the stem leans forward, in lengths
UNSTATED = 0.55  # side of the superstructure of a vessel that states no area, in beams
HOUSE_WIDEST = 0.8  # in beams


def drawn_vessel(hull: Hull, superstructure_area: float, *, with_lines: bool) -> MeshDescription:
    """Return the mesh that pictures and the viewer show, in the body frame.

    superstructure_area [m2]: the wheelhouse fills it, as high as wide where the beam allows; 0: it has a usual one. with_lines: a hull with
    stem, sheer and transom as long, broad and deep as hers is drawn, in place of the hull that floats; False where particles meet her.
    """
    low, high = hull.mesh.bounds
    shape = _ship_lines(hull) if with_lines else hull.mesh
    side = np.sqrt(superstructure_area) if superstructure_area else UNSTATED * hull.beam
    width = min(side, HOUSE_WIDEST * hull.beam)
    height = side**2 / width
    start = np.array([0.5 * (low[0] + high[0]), 0.0, high[2]])
    parts = [(shape.vertices, shape.faces, _paint(hull, shape))]
    for length, broad, bottom, top, color in (
        (1.3, 1.0, -0.1, 0.55, palette.HOUSE),
        (0.8, 0.85, 0.55, 0.65, palette.HOUSE),
        (0.82, 0.88, 0.65, 0.9, palette.GLASS),
        (0.9, 0.95, 0.9, 1.0, palette.HOUSE),
        (0.06, 0.06, 1.0, 1.6, palette.MAST),
    ):
        size = np.array([length * width, broad * width, (top - bottom) * height])
        box = trimesh.creation.box(size)
        center = start + np.array([0.1 * hull.length, 0.0, 0.5 * (bottom + top) * height])
        parts.append((box.vertices + center, box.faces, np.tile(color, (len(box.faces), 1))))
    ends = np.cumsum([0, *(len(vertices) for vertices, _, _ in parts)])
    return MeshDescription(
        vertices=np.concatenate([vertices for vertices, _, _ in parts]),
        faces=np.concatenate([faces + end for (_, faces, _), end in zip(parts, ends, strict=False)]),
        face_colors=np.concatenate([colors for _, _, colors in parts]),
    )


def _ship_lines(hull: Hull) -> trimesh.Trimesh:
    """Return a hull with a raked stem, a deck that rises towards it, and a transom."""
    low, high = hull.mesh.bounds
    ahead = np.maximum(STATIONS, 0.0)
    run = np.clip((STATIONS - PARALLEL) / (1.0 - PARALLEL), 0.0, None)
    breadth = 0.5 * hull.beam * (1.0 - run**2.5)
    breadth[0] = 0.0
    level = np.array([high[2], hull.waterline, low[2], low[2]])  # deck, water, bilge, keel
    part = np.array([1.0, 0.95, BOTTOM, 0.0])
    z = np.repeat(level[None], len(STATIONS), axis=0)
    z[:, 0] += SHEER * hull.depth * ahead**2
    lean = STEM_RAKE * hull.length * np.outer(ahead**3, (high[2] - level) / hull.depth)
    x = 0.5 * (low[0] + high[0]) + 0.5 * hull.length * STATIONS[:, None] - lean
    y = breadth[:, None] * part
    half = np.stack([x, y, z], axis=2)
    other = half[:, -2::-1] * (1.0, -1.0, 1.0)
    return tube(np.concatenate([half, other], axis=1))


def _paint(hull: Hull, shape: trimesh.Trimesh) -> NDArray[np.uint8]:
    """Return the colours (F, 4) of a hull's faces: bottom, sides and deck."""
    height = shape.triangles[..., 2] - hull.waterline
    deck = (shape.face_normals[:, 2] > 0.7) & (height.min(axis=1) > 0.0)
    bottom = height.max(axis=1) < 1e-6 * hull.depth
    sides: Color = palette.body_color("vessels/any", None)
    colors = np.where(bottom[:, None], palette.BOTTOM, sides)
    return np.where(deck[:, None], palette.DECK, colors).astype(np.uint8)
