"""The colours of a recording, the same in the viewer and in drawn pictures."""

from __future__ import annotations

from recordings import entity_paths
from recordings.frame import Color, MeshDescription, PhaseDescription

WATER: Color = (64, 140, 196, 255)
OIL: Color = (48, 28, 12, 255)
WALL: Color = (150, 150, 155, 255)
FORCE: Color = (214, 40, 110, 255)
_OTHERS: tuple[Color, ...] = ((196, 120, 40, 255), (86, 150, 92, 255), (150, 96, 170, 255))
_BODIES: dict[str, Color] = {
    entity_paths.VESSELS: (178, 36, 44, 255),
    entity_paths.BOOM: (255, 122, 20, 255),
    entity_paths.BODIES: (128, 122, 112, 255),
}


def is_oil(name: str) -> bool:
    """Whether a phase's name says that it is oil; everything else is drawn as something to look through."""
    return any(word in name.lower() for word in ("oil", "crude", "diesel", "fuel"))


def is_water(name: str) -> bool:
    """Whether a phase's name says that it is water."""
    return any(word in name.lower() for word in ("water", "ocean", "sea"))


def phase_color(phase: PhaseDescription, index: int) -> Color:
    """A phase's own colour, or dark for oil, blue for water, and something else for others."""
    if phase.color is not None:
        return phase.color
    if is_oil(phase.name):
        return OIL
    return WATER if is_water(phase.name) else _OTHERS[index % len(_OTHERS)]


def body_color(name: str, mesh: MeshDescription | None) -> Color:
    """A body's own colour, or the colour of its group."""
    if mesh is not None and mesh.color is not None:
        return mesh.color
    return _BODIES[entity_paths.body_group(name)]
