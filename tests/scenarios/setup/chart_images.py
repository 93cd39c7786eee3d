"""An image of a chart whose place is known: one black rectangle on white, turned and to scale."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from recordings.model.exercise import Site
from recordings.model.tangent_plane import longitude_latitude

SIZE = (300, 200)  # [pixels]
BLACK = ((100, 40), (220, 40), (220, 150), (100, 150))  # [pixels] corners of the rectangle
SCALE, TURN, CORNER = (
    0.25,
    np.radians(-70.0),
    np.array([-20.0, 12.0]),
)  # [m] a pixel, of the way along from x, [m] upper left


def draw_chart(path: Path) -> None:
    """Write the image."""
    image = Image.new("RGB", SIZE, "white")
    ImageDraw.Draw(image).rectangle((*BLACK[0], BLACK[2][0] - 1, BLACK[2][1] - 1), fill="black")
    image.save(path)


def place_of(pixels: np.ndarray) -> np.ndarray:
    """Return where pixels (N, 2), right and down, lie (N, 2) [m]."""
    right = SCALE * np.array([np.cos(TURN), np.sin(TURN)])
    down = np.array([right[1], -right[0]])
    return CORNER + np.asarray(pixels, float) @ np.stack([right, down])


def fixed_points(site: Site, pixels: object) -> list[list[float]]:
    """Return rows of pixel x and y, longitude and latitude."""
    found = np.asarray(pixels, float)
    return np.column_stack([found, *longitude_latitude(site, place_of(found))]).tolist()


def chart_text(site: Site, file: Path) -> str:
    """Return the tables of a site with this chart, and of land that is its black rectangle."""
    return f"""
[site]
latitude = {site.latitude}
longitude = {site.longitude}
bearing_deg = {site.bearing}
[site.chart]
file = "{file}"
points = {fixed_points(site, [(5, 5), (290, 180)])}
[land.island]
outline = {place_of(np.array(BLACK)).tolist()}
"""
