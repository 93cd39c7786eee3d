"""The chart of a site: its image is read, and laid on the tangent plane by points whose place is known."""

from __future__ import annotations

import base64
import cmath
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from recordings.model.exercise import ChartImage
from recordings.model.tangent_plane import world_points
from recordings.model.words import course_in_words, three_figures
from scenarios.schema.run_settings import SiteSettings
from scenarios.text.problems import Problem, reason_of

Complex = NDArray[np.complex128]

LARGEST_FILE = 4e6  # [bytes], which each page and each recording holds
MOST_PIXELS = 40e6  # [1]; a page draws more only slowly
FARTHEST = 100e3  # [m] of a point from the origin; the tangent plane is 200 m wrong half as far away, at 45 degrees
FINEST, COARSEST = 0.01, 100.0  # [m] that a pixel may be wide; what lies beyond is a slip
LEAST_SPREAD = (
    0.05  # [1] of the image's diagonal, between the points farthest apart: a slip of a pixel grows twentyfold
)
MOST_MISFIT = 0.01  # [1] of the diagonal, beyond which a warning is given


@dataclass(frozen=True)
class SiteChart:
    """A chart in its place, None without one; facts and notes: what is to be told and warned of."""

    image: ChartImage | None = None
    facts: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def read_chart(site: SiteSettings | None, problems: list[Problem]) -> SiteChart:
    """Return the chart of a site; what is wrong with it is added to `problems`."""
    if site is None or site.chart is None:
        return SiteChart()
    key, file = "file", Path(site.chart.file)
    try:
        image, size = _read(file)
        key = "points"
        return _laid(image, size, site)
    except (OSError, ValueError) as error:
        problems.append(Problem(f"site.chart.{key}", f"{file.name}: {reason_of(error)}"))
        return SiteChart()


def _read(file: Path) -> tuple[str, tuple[int, int]]:
    """Read an image: its data URL, its width and height [pixels] as it is shown. OSError, or ValueError for what is none or too large."""
    from PIL import Image, ImageOps

    content = file.read_bytes()
    if len(content) > LARGEST_FILE:
        raise ValueError(f"holds {len(content) / 1e6:.3g} MB, allowed: up to {LARGEST_FILE / 1e6:g} MB")
    try:
        with Image.open(io.BytesIO(content), formats=("PNG", "JPEG")) as image:
            if (pixels := image.width * image.height) <= MOST_PIXELS:
                kind, size = str(image.format).lower(), ImageOps.exif_transpose(image).size
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise ValueError("cannot be read as an image, allowed: PNG or JPEG") from error
    if pixels > MOST_PIXELS:
        raise ValueError(f"has {pixels / 1e6:.3g} million pixels, allowed: up to {MOST_PIXELS / 1e6:g} million")
    return f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}", size


def _laid(image: str, size: tuple[int, int], site: SiteSettings) -> SiteChart:
    """Lay an image of a size [pixels] by its points; ValueError for points that cannot be right.

    A point of the plane is the complex number x + i y, a pixel is column - i row, so that both turn the same way: place = origin + along
    pixel, by least squares.
    """
    assert site.chart is not None
    columns, rows, longitude, latitude = np.array(site.chart.points).T
    places = world_points(site.recorded, longitude, latitude) @ np.array([1.0, 1.0j])
    pixels, diagonal = columns - 1.0j * rows, float(np.hypot(*size))
    for number, (column, row, place) in enumerate(zip(columns, rows, places, strict=True), 1):
        if not (0.0 <= column <= size[0] and 0.0 <= row <= size[1]):
            at = f"point {number} is pixel {column:g}, {row:g}"
            raise ValueError(f"{at}, allowed: within the image of {size[0]} by {size[1]} pixels")
        if abs(place) > FARTHEST:
            at = f"point {number} lies {abs(place) / 1e3:.4g} km from the site"
            raise ValueError(f"{at}, allowed: up to {FARTHEST / 1e3:g} km, as pixel x, pixel y, longitude, latitude")
    spread = float(np.hypot(np.ptp(columns), np.ptp(rows)))
    if spread < LEAST_SPREAD * diagonal:
        least = f"{LEAST_SPREAD * diagonal:.0f} pixels, a twentieth of the diagonal, or more"
        raise ValueError(f"has points at most {spread:.3g} pixels apart, allowed: {least}")
    origin, along, misfit = _fitted(pixels, places)
    if not FINEST <= abs(along) <= COARSEST:
        raise ValueError(f"makes a pixel {round(abs(along), 6):.3g} m wide, allowed: {FINEST:g} to {COARSEST:g} m")
    share = misfit / (abs(along) * diagonal)
    if share > MOST_MISFIT and _fitted(pixels.conj(), places)[2] < 0.5 * misfit:
        raise ValueError("fits a mirrored chart, allowed: pixels right of and below the image's upper left corner")
    up = course_in_words(cmath.phase(1.0j * along), site.bearing)
    told = f"chart {Path(site.chart.file).name}: a pixel is {three_figures(abs(along))} m wide, up is {up}°"
    miss = (
        f"site.chart.points: the worst is {misfit:.3g} m ({100.0 * share:.2g} % of the chart's diagonal) off its place"
    )
    laid = ChartImage(image=image, origin=(origin.real, origin.imag), along=(along.real, along.imag))
    exact = len(pixels) == 2
    notes = (f"{miss}; are its pixels and degrees right?",) if share > MOST_MISFIT else ()
    return SiteChart(laid, (told,) if exact or notes else (told, miss), notes)


def _fitted(pixels: Complex, places: Complex) -> tuple[complex, complex, float]:
    """Return origin, along and the misfit [m] of the worst point of place = origin + along pixel (N,) [m], by least squares."""
    middle, apart = pixels.mean(), pixels - pixels.mean()
    along = complex(np.vdot(apart, places - places.mean()) / np.vdot(apart, apart).real)
    origin = complex(places.mean() - along * middle)
    return origin, along, float(np.abs(origin + along * pixels - places).max())
