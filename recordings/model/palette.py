"""The colours of a recording, the same in the viewer and in drawn pictures."""

from __future__ import annotations

import colorsys
import zlib

import numpy as np
import numpy.typing as npt

from recordings.model import entity_paths
from recordings.model.frame import Color, MeshDescription, PhaseDescription

WATER: Color = (64, 140, 196, 255)
OIL: Color = (48, 28, 12, 255)
WALL: Color = (150, 150, 155, 255)
SEA: Color = (72, 148, 186, 255)  # by day
CLEAR_WATER: Color = (72, 148, 186, 120)  # of a tank
WINDOW: Color = (20, 90, 150, 255)  # outline of a window of particles on maps
EQUIPMENT: Color = (208, 32, 120, 255)  # skimmers, mooring legs and ties: on water, on oil and on paper
DECK: Color = (104, 122, 112, 255)  # of vessels, with what stands on it, and their bottom
BOTTOM, HOUSE, GLASS, MAST = (140, 44, 36, 255), (236, 236, 230, 255), (38, 52, 66, 255), (226, 120, 30, 255)
NAME: Color = (184, 70, 0, 255)  # on light and on dark ground
LIMIT: Color = (200, 40, 40, 255)
FORCE: Color = (214, 40, 110, 255)
_OTHERS: tuple[Color, ...] = ((196, 120, 40, 255), (86, 150, 92, 255), (150, 96, 170, 255))
_BODIES: dict[str, Color] = {
    entity_paths.VESSELS: (34, 52, 92, 255),
    entity_paths.BOOM: (255, 122, 20, 255),
    entity_paths.BODIES: (128, 122, 112, 255),
}
CAUSES: dict[str, tuple[str, Color]] = {
    "drainage": ("red", (222, 32, 32, 255)),
    "entrainment": ("magenta", (226, 0, 150, 255)),
    "critical_accumulation": ("purple", (132, 62, 204, 255)),
    "planing": ("yellow", (250, 205, 0, 255)),
    "submergence": ("teal", (0, 150, 150, 255)),
    "splash_over": ("white", (255, 255, 255, 255)),
    "around_ends": ("green", (40, 168, 62, 255)),
    "through": ("pink", (255, 150, 178, 255)),
}
# thickness [m] from which oil has an appearance, words, colour, and the part of the water's colour that it hides: the Bonn Agreement Oil
# Appearance Code up to 0.2 mm (sheen, rainbow, metallic, discontinuous true colour), browns of our own above
FILM: tuple[tuple[float, str, Color, float], ...] = (
    (0.0, "sheen", (184, 195, 201, 255), 0.55),
    (0.3e-6, "rainbow", (183, 154, 200, 255), 0.6),
    (5e-6, "metallic", (127, 149, 163, 255), 0.65),
    (50e-6, "0.05 mm", (176, 141, 87, 255), 0.7),
    (200e-6, "0.2 mm", (143, 100, 48, 255), 0.75),
    (1e-3, "1 mm", (99, 66, 29, 255), 0.8),
    (10e-3, "10 mm", (61, 39, 16, 255), 0.85),
    (50e-3, "50 mm", (29, 18, 7, 255), 0.9),
)
# [m] of spots that tell the volume of oil by their area, however thin its film is: 1 m2 for 10 litres; chosen
SPOT_THICKNESS = 0.01
_THINNEST = 0.04e-6  # [m] of a film that can be seen (Bonn Agreement)
_SERIES: dict[str, Color] = {
    "oil_contained": (120, 84, 40, 255),
    "oil_lost": (222, 32, 32, 255),
    "port": (200, 40, 60, 255),
    "starboard": (40, 150, 70, 255),
    "tow_speed": (224, 123, 32, 255),
    "normal_speed_held": (31, 95, 168, 255),
}
_HUES = 997  # prime, so that names that differ little get hues that differ much
_TENSION = np.array([[255, 236, 150], [255, 186, 60], [246, 112, 20], [200, 24, 30], [110, 0, 40]])


def cause_color(cause: str) -> Color:
    """Return the colour of oil that was lost by a cause."""
    return CAUSES.get(cause, ("grey", (120, 120, 120, 255)))[1]


def spot_radius(volume: npt.NDArray[np.floating]) -> npt.NDArray[np.float32]:
    """Return the radii (N,) [m] of round spots of `SPOT_THICKNESS` that tell volumes (N,) [m3]."""
    return np.sqrt(volume / (np.pi * SPOT_THICKNESS)).astype(np.float32)


def spot_in_words() -> str:
    """Return what a spot's area means."""
    return f"a spot of 1 m² is {1e3 * SPOT_THICKNESS:g} litres"


def film_colors(thickness: npt.NDArray[np.floating]) -> npt.NDArray[np.uint8]:
    """Return the colours (R, C, 3) of films (R, C) [m] on the sea by day; a film too thin to be seen has the water's."""
    place = np.searchsorted([start for start, *_ in FILM], thickness, side="right")  # 0: no film
    water = np.array(SEA[:3], dtype=np.float64)
    hidden = np.array([0.0, *(part for *_, part in FILM)])[:, None]
    table = (1.0 - hidden) * water + hidden * np.array([water, *(color[:3] for _, _, color, _ in FILM)])
    return np.asarray(table.round().astype(np.uint8)[np.where(thickness < _THINNEST, 0, place)])


def series_color(name: str) -> Color:
    """Return a colour for a series, the same in every run; tensions at port and starboard are red and green, held oil is dark."""
    last = name.rpartition("/")[2]
    if last in _SERIES:
        return _SERIES[last]
    hue = (zlib.crc32(name.encode()) % _HUES) / _HUES
    red, green, blue = (round(255.0 * part) for part in colorsys.hsv_to_rgb(hue, 0.75, 0.8))
    return red, green, blue, 255


def css(color: Color) -> str:
    """Write a colour, without its opacity, as web pages and diagrams do: #rrggbb."""
    return "#" + "".join(f"{channel:02x}" for channel in color[:3])


def tension_color(tension: npt.ArrayLike, full_tension: float) -> npt.NDArray[np.uint8]:
    """Return the colours (N, 4) of a boom under tensions (N,) [N]: pale at 0, orange at half, dark red from full tension on."""
    place = np.clip(np.atleast_1d(tension) / full_tension, 0.0, 1.0) * (len(_TENSION) - 1)
    channels = [np.interp(place, np.arange(len(_TENSION)), _TENSION[:, channel]) for channel in range(3)]
    return np.column_stack([*channels, np.full(len(place), 255.0)]).round().astype(np.uint8)


def is_water(phase: PhaseDescription) -> bool:
    """Tell whether a phase is water by its name, and not oil; water is drawn transparent."""
    return not phase.is_oil and any(word in phase.name.lower() for word in ("water", "ocean", "sea"))


def phase_color(phase: PhaseDescription, index: int) -> Color:
    """Return a phase's own colour, or the usual one: dark for oil, blue for water, others in turn."""
    if phase.color is not None:
        return phase.color
    if phase.is_oil:
        return OIL
    return WATER if is_water(phase) else _OTHERS[index % len(_OTHERS)]


def body_color(name: str, mesh: MeshDescription | None) -> Color:
    """Return a body's own colour, or the colour of its group."""
    if mesh is not None and mesh.color is not None:
        return mesh.color
    return _BODIES[entity_paths.body_group(name)]
