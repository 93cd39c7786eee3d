"""Drawing of spheres, triangles and clear water with numpy alone: no window, no graphics driver.

A pinhole camera looks from the eye at the target, z up. Opaque things share one depth buffer. Water is drawn last: it absorbs light
on its way (Beer-Lambert: the fraction exp(-s / a) is left after a thickness s).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter, map_coordinates

from recordings.model.frame import Color
from recordings.model.surface import SurfaceFrame

Floats = npt.NDArray[np.floating]
_LIGHT = np.array([-0.35, -0.5, 0.8]) / np.linalg.norm([-0.35, -0.5, 0.8])
_AMBIENT = 0.45
_SPHERE_FILL = 6.0 / np.pi  # volume of a cube / volume of the sphere inside it
_LARGEST_BLUR = 3.0  # [pixels]; a few large particles are seen one by one, not as fog
_NEAR = 1e-3
_GRAZING = -1e-3  # slope of a line of sight that still meets the sea
_STEPS = 4  # to the place at which a line of sight meets the waves
_HAZE = 8.0  # distance at which haze hides all but a third of the sea, in widths of the exercise
_SKYLINE = np.array([0.86, 0.91, 0.95])


@dataclass(frozen=True, kw_only=True, eq=False)
class Projection:
    """A projection of world points to pixels and depth.

    Attributes:
        eye: (3,) [m].
        axes: (3, 3) unit vectors right, down and forward, as rows.
        focal: pixels for a slope of one.
        center: (2,) pixel on the line of sight.
    """

    eye: Floats
    axes: Floats
    focal: float
    center: Floats

    def __call__(self, points: Floats) -> tuple[Floats, Floats]:
        """Compute pixels (N, 2) and depths (N,) [m] along the line of sight of world points (N, 3) [m]."""
        seen = (np.asarray(points, dtype=np.float64) - self.eye) @ self.axes.T
        depth = np.maximum(seen[:, 2], _NEAR)
        return seen[:, :2] / depth[:, None] * self.focal + self.center, depth


def fitted_projection(eye: Floats, target: Floats, points: Floats, width: int, height: int) -> Projection:
    """Place a camera at ``eye`` (3,) [m] that looks to ``target`` (3,) [m], zoomed so that all ``points`` (N, 3) [m] are visible."""
    forward = np.asarray(target, dtype=np.float64) - eye
    forward /= np.linalg.norm(forward)
    up = np.array([0.0, 0.0, 1.0]) if abs(forward[2]) < 0.999 else np.array([0.0, 1.0, 0.0])
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(forward, right), forward])
    seen = (np.asarray(points, dtype=np.float64) - eye) @ axes.T
    slopes = seen[:, :2] / np.maximum(seen[:, 2:], _NEAR)
    lower, upper = slopes.min(axis=0), slopes.max(axis=0)
    focal = float(np.min(np.array([width, height]) / np.maximum(upper - lower, 1e-9)))
    center = 0.5 * np.array([width, height]) - focal * 0.5 * (lower + upper)
    return Projection(eye=np.asarray(eye, dtype=np.float64), axes=axes, focal=focal, center=center)


class Canvas:
    """A picture that is being drawn: colours (height, width, 3) from 0 to 1, and a depth [m] for each pixel."""

    def __init__(self, projection: Projection, width: int, height: int) -> None:
        """Start with a pale sky that is lighter below."""
        self.projection = projection
        self.width, self.height = width, height
        shade = np.linspace(0.86, 0.97, height)[:, None, None]
        self.image = np.ones((height, width, 3)) * shade * np.array([0.97, 0.99, 1.0])
        self.depth = np.full(height * width, np.inf)

    def spheres(self, points: Floats, radius: float | Floats, color: Color) -> None:
        """Draw opaque shaded balls at points (N, 3) [m] with one radius [m], or one each (N,), and one colour."""
        nearest = self.depth.copy()
        for pixel, depth, _ in self._splats(points, radius):
            np.minimum.at(nearest, pixel, depth)
        flat = self.image.reshape(-1, 3)
        tint = np.array(color[:3]) / 255.0
        for pixel, depth, bulge in self._splats(points, radius):
            front = depth <= nearest[pixel]
            hidden = depth > self.depth[pixel]
            shown = front & ~hidden
            brightness = _AMBIENT + (1.15 - _AMBIENT) * bulge[shown]
            flat[pixel[shown]] = np.clip(tint * brightness[:, None], 0.0, 1.0)
        self.depth = nearest

    def triangles(self, vertices: Floats, faces: npt.NDArray[np.integer], color: Color) -> None:
        """Draw opaque flat-shaded triangles (F, 3) with vertices (V, 3) [m], lit from both sides."""
        pixels, depth = self.projection(vertices)
        corner = np.asarray(vertices, dtype=np.float64)[faces]
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        length = np.linalg.norm(normal, axis=1)
        light = _AMBIENT + (1.0 - _AMBIENT) * np.abs(normal @ _LIGHT) / np.maximum(length, 1e-30)
        tint = np.array(color[:3]) / 255.0
        for face, brightness in zip(faces[length > 0.0], light[length > 0.0], strict=True):
            self._triangle(pixels[face], depth[face], tint * brightness)

    def sea(self, surface: SurfaceFrame, image: npt.NDArray[np.uint8] | None, color: Color) -> None:
        """Draw the opaque surface of a sea with the colours `image` (R, C, 3) within its box, or with one colour, in daylight.

        Each line of sight meets the surface where a few steps along it, from the height below one step to the next, come to rest.
        """
        number = np.arange(self.height * self.width)
        pixel = np.stack([number % self.width, number // self.width], axis=-1) + 0.5 - self.projection.center
        sight = np.column_stack([pixel / self.projection.focal, np.ones(len(pixel))]) @ self.projection.axes
        seen = np.flatnonzero(sight[:, 2] < _GRAZING)
        sight = sight[seen]
        level = float(np.median(surface.height))
        way = (level - self.projection.eye[2]) / sight[:, 2]
        for _ in range(_STEPS):
            places = self.projection.eye[:2] + way[:, None] * sight[:, :2]
            way = (_on_grid(surface, surface.height, places) - self.projection.eye[2]) / sight[:, 2]
        front = (way > _NEAR) & (way < self.depth[seen])
        number, way, places = seen[front], way[front], places[front]
        light = _on_grid(surface, surface.brightness.reshape(surface.height.shape), places)[:, None]
        paint = _in_box(surface, image, color, places) * light
        haze = (
            1.0
            - np.exp(-way / (_HAZE * max(surface.box[2] - surface.box[0], surface.box[3] - surface.box[1])))[:, None]
        )
        flat = self.image.reshape(-1, 3)
        flat[number] = np.clip(paint * (1.0 - haze) + _SKYLINE * haze, 0.0, 1.0)
        self.depth[number] = way

    def water(self, points: Floats, spacing: float, color: Color, clearness: float) -> None:
        """Draw clear water of particles at points (N, 3) [m], ``spacing`` [m] apart; light reaches ``clearness`` [m] far."""
        thickness = np.zeros(self.height * self.width)
        surface = np.full(self.height * self.width, np.inf)
        for pixel, depth, bulge in self._splats(points, 0.5 * spacing):
            before = depth < self.depth[pixel]
            chord = _SPHERE_FILL * spacing * bulge[before]
            np.add.at(thickness, pixel[before], chord)  # a sum over the whole picture would take most of the time
            np.minimum.at(surface, pixel[before], depth[before])
        blur = min(0.35 * self._pixels(spacing, points), _LARGEST_BLUR)
        smooth = gaussian_filter(thickness.reshape(self.height, self.width), blur)
        left = np.exp(-smooth / clearness)[..., None]
        shine = self._shine(surface.reshape(self.height, self.width), 2.0 * blur)[..., None]
        deep = np.array(color[:3]) / 255.0
        covered = np.clip(smooth / (0.5 * spacing), 0.0, 1.0)[..., None]
        self.image = np.clip(self.image * left + deep * (1.0 - left) + 0.5 * covered * shine, 0.0, 1.0)

    def _shine(self, surface: Floats, blur: float) -> Floats:
        """Compute light and shadow of a water surface from the slope of its smoothed depth: small numbers around 0."""
        known = np.isfinite(surface)
        if not known.any():
            return np.zeros_like(surface)
        weight = gaussian_filter(known.astype(float), blur)
        mean = gaussian_filter(np.where(known, surface, 0.0), blur) / np.maximum(weight, 1e-6)
        slope = np.gradient(mean, axis=0) - gaussian_filter(np.gradient(mean, axis=0), 12.0 * blur)
        scale = np.std(slope[known]) or 1.0
        edge = np.clip((weight - 0.5) * 2.0, 0.0, 1.0)
        return -0.12 * np.clip(slope / scale, -2.0, 2.0) * edge

    def _pixels(self, length: float, points: Floats) -> float:
        """Return the number of pixels that ``length`` [m] takes at the middle of ``points``."""
        _, depth = self.projection(np.median(points, axis=0)[None])
        return float(max(1.0, length * self.projection.focal / depth[0]))

    def _splats(self, points: Floats, radius: float | Floats) -> Iterator[tuple[npt.NDArray[np.int64], Floats, Floats]]:
        """Yield pixel numbers, depths and bulges (1 in the middle of a ball, 0 at its rim), for one offset in the balls at a time."""
        if len(points) == 0:
            return
        pixels, depth = self.projection(points)
        radius = np.broadcast_to(radius, len(points))
        size = np.maximum(radius * self.projection.focal / depth, 0.75)
        reach = int(np.ceil(np.percentile(size, 99.0)))
        corner = np.floor(pixels).astype(np.int64)
        for down in range(-reach, reach + 1):
            for right in range(-reach, reach + 1):
                at = corner + np.array([right, down])
                away = ((at + 0.5 - pixels) ** 2).sum(axis=1) / size**2
                inside = (away < 1.0) & (depth > 2.0 * _NEAR) & (at >= 0).all(axis=1)
                inside &= (at[:, 0] < self.width) & (at[:, 1] < self.height)
                bulge = np.sqrt(1.0 - away[inside])
                number = at[inside, 1] * self.width + at[inside, 0]
                yield number, depth[inside] - radius[inside] * bulge, bulge

    def _triangle(self, pixels: Floats, depth: Floats, color: Floats) -> None:
        """Fill one triangle where it is in front; the reciprocal of depth is linear over the picture."""
        lower = np.maximum(np.floor(pixels.min(axis=0)).astype(int), 0)
        upper = np.minimum(np.ceil(pixels.max(axis=0)).astype(int), [self.width, self.height])
        if (upper <= lower).any() or (depth <= 2.0 * _NEAR).any():
            return
        x, y = np.meshgrid(np.arange(lower[0], upper[0]) + 0.5, np.arange(lower[1], upper[1]) + 0.5)
        (x0, y0), (x1, y1), (x2, y2) = pixels
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if abs(area) < 1e-9:
            return
        first = ((x1 - x) * (y2 - y) - (x2 - x) * (y1 - y)) / area
        second = ((x2 - x) * (y0 - y) - (x0 - x) * (y2 - y)) / area
        third = 1.0 - first - second
        inverse = first / depth[0] + second / depth[1] + third / depth[2]
        inside = (first >= 0.0) & (second >= 0.0) & (third >= 0.0)
        here = np.s_[lower[1] : upper[1], lower[0] : upper[0]]
        buffer = self.depth.reshape(self.height, self.width)[here]
        shown = inside & (inverse * buffer > 1.0)
        buffer[shown] = 1.0 / inverse[shown]
        self.image[here][shown] = np.clip(color, 0.0, 1.0)


def _on_grid(surface: SurfaceFrame, values: Floats, places: Floats) -> Floats:
    """Interpolate values (N, M) on the lines of a surface's grid to places (K, 2) [m]; beyond it they go on."""
    lines = [np.interp(places[:, axis], at, np.arange(len(at))) for axis, at in enumerate((surface.x, surface.y))]
    return np.asarray(map_coordinates(values, lines, order=1, mode="nearest"))


def _in_box(surface: SurfaceFrame, image: npt.NDArray[np.uint8] | None, color: Color, places: Floats) -> Floats:
    """Return the colours (K, 3) from 0 to 1 of places (K, 2) [m]: of the image in the surface's box, else the one colour."""
    paint = np.tile(np.array(color[:3]) / 255.0, (len(places), 1))
    if image is None:
        return paint
    low, high = np.array(surface.box[:2]), np.array(surface.box[2:])
    part = (places - low) / (high - low)
    inside = ((part >= 0.0) & (part < 1.0)).all(axis=1)
    lines = (part[inside] * image.shape[:2] - 0.5).T
    for channel in range(3):
        found = map_coordinates(image[..., channel].astype(np.float64), lines, order=1, mode="nearest")
        paint[inside, channel] = found / 255.0
    return paint
