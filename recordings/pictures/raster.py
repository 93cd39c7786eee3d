"""Drawing of spheres, triangles, lines, seas and clear water with numpy alone: no window, no graphics driver.

A pinhole camera looks from the eye at the target, z up. Opaque things share one depth buffer. Water is drawn last: it absorbs light
on its way (Beer-Lambert: the fraction exp(-s / a) is left after a thickness s).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter, map_coordinates, zoom

from recordings.model.frame import Color
from recordings.model.surface import SurfaceFrame

Floats = npt.NDArray[np.floating]
Foam = Callable[[Floats, Floats], Floats]  # places (K, 2) [m], lengths (K,) [m] of pixels there: whiteness (K,)
_LIGHT = np.array([-0.35, -0.5, 0.8]) / np.linalg.norm([-0.35, -0.5, 0.8])
_AMBIENT = 0.45
_SPHERE_FILL = 6.0 / np.pi  # volume of a cube / volume of the sphere inside it
_LARGEST_BLUR = 3.0  # [shown pixels]; a few large particles are seen one by one, not as fog
_NEAR = 1e-3
_GRAZING = -1e-3  # slope of a line of sight that still meets the sea
_STEPS = 2  # to the place at which a line of sight meets the waves
_HAZE = 8.0  # distance at which haze hides all but a third of the sea, in those of the middle of the seen sea, so that haze stays
_SKYLINE, _ZENITH = np.array([0.86, 0.91, 0.95]), np.array([0.55, 0.71, 0.88])  # colours of the sky
_FOAM = 0.95  # [1] brightness of foam, which has no colour
_SAME = 0.01  # [1] difference of a colour from that of water without oil
_NORMAL_REFLECTANCE = 0.02  # [1] of water from straight above: ((n - 1) / (n + 1))^2 with n = 1.33
FINER = 4  # points to an interval of a surface's grid, and to a cell of its image, through which smooth curves run
_CANDIDATES = 2_000_000  # pixels that are tried at a time, which bounds the memory
_COVERED = 4.0  # widths of a line by which it is drawn nearer, so that the surface on which it lies does not hide it


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

    def pixels(self, length: float, points: Floats) -> float:
        """Return the number of pixels that ``length`` [m] takes at the middle of ``points`` (N, 3) [m]."""
        _, depth = self(np.median(points, axis=0)[None])
        return float(length * self.focal / depth[0])


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

    def __init__(self, projection: Projection, width: int, height: int, *, fineness: int = 1) -> None:
        """Start with a pale sky that is lighter below; each pixel is drawn as `fineness` x `fineness`, for smooth edges."""
        self.fineness = fineness
        self.projection = replace(projection, focal=fineness * projection.focal, center=fineness * projection.center)
        self.width, self.height = fineness * width, fineness * height
        shade = np.linspace(0.86, 0.97, self.height)[:, None, None]
        self.image = np.ones((self.height, self.width, 3)) * shade * np.array([0.97, 0.99, 1.0])
        self.depth = np.full(self.height * self.width, np.inf)

    @property
    def shown(self) -> Floats:
        """The picture (height, width, 3) as it is shown: each of its pixels is the mean of those drawn."""
        many = self.fineness
        return np.asarray(self.image.reshape(self.height // many, many, -1, many, 3).mean(axis=(1, 3)))

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

    def triangles(self, vertices: Floats, faces: npt.NDArray[np.integer], color: npt.ArrayLike) -> None:
        """Draw opaque flat-shaded triangles (F, 3) with vertices (V, 3) [m], lit from both sides, in one colour or one for each (F, 4)."""
        pixels, depth = self.projection(vertices)
        corner = np.asarray(vertices, dtype=np.float64)[faces]
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        length = np.linalg.norm(normal, axis=1)
        light = _AMBIENT + (1.0 - _AMBIENT) * np.abs(normal @ _LIGHT) / np.maximum(length, 1e-30)
        self._fill(pixels[faces], depth[faces], np.atleast_2d(color)[:, :3] / 255.0 * light[:, None])

    def lines(self, ends: Floats, width: float, color: npt.ArrayLike) -> None:
        """Draw straight lines between ends (L, 2, 3) [m], all of a width [shown pixels] however far they are, each in its colour (L, 4)."""
        width *= self.fineness
        pixels, depth = (part.reshape(-1, 2, *part.shape[1:]) for part in self.projection(np.reshape(ends, (-1, 3))))
        along = pixels[:, 1] - pixels[:, 0]
        across = 0.5 * width * along[:, ::-1] * (-1.0, 1.0) / np.maximum(np.linalg.norm(along, axis=1), _NEAR)[:, None]
        corners = np.stack([pixels - across[:, None], pixels + across[:, None]], axis=1).reshape(-1, 4, 2)
        halves = np.array([[0, 1, 2], [1, 3, 2]])
        near = np.tile(depth * (1.0 - _COVERED * width / self.projection.focal), (1, 2))
        tint = np.repeat(np.asarray(color)[:, :3] / 255.0, 2, axis=0)
        self._fill(corners[:, halves].reshape(-1, 3, 2), near[:, halves].reshape(-1, 3), tint)

    def sea(self, surface: SurfaceFrame, image: npt.NDArray[np.uint8] | None, color: Color, foam: Foam) -> None:
        """Draw the opaque surface of a sea with the colours `image` (R, C, 3) within its box, or with one colour, in daylight.

        It mirrors the sky, the more the flatter it is seen, is white by `foam` where no oil is, and fades into haze. Each line of sight
        meets the surface where a few steps along it, from the height below one step to the next, come to rest.
        """
        shape = (self.height // self.fineness, self.width // self.fineness)  # it has no edges that would be rough
        pixel = self.fineness * (np.indices(shape)[::-1].reshape(2, -1).T + 0.5) - self.projection.center
        sight = np.column_stack([pixel / self.projection.focal, np.ones(len(pixel))]) @ self.projection.axes
        seen = np.flatnonzero(sight[:, 2] < _GRAZING)
        sight = sight[seen]
        level = float(np.median(surface.height))
        way = (level - self.projection.eye[2]) / sight[:, 2]
        for _ in range(_STEPS):
            places = self.projection.eye[:2] + way[:, None] * sight[:, :2]
            way = (on_grid(surface, surface.height, places) - self.projection.eye[2]) / sight[:, 2]
        light = on_grid(surface, zoom(surface.brightness.reshape(surface.height.shape), FINER), places)[:, None]
        paint = _in_box(surface, image, color, places)
        bare = np.flatnonzero((np.abs(paint - np.array(color[:3]) / 255.0) < _SAME).all(axis=1))
        paint *= light
        down = -sight[:, 2:] / np.linalg.norm(sight, axis=1, keepdims=True)
        mirrored = _NORMAL_REFLECTANCE + (1.0 - _NORMAL_REFLECTANCE) * (1.0 - down) ** 5  # Schlick (1994)
        paint += mirrored * (_SKYLINE + (_ZENITH - _SKYLINE) * down - paint)
        white = foam(places[bare], way[bare] / (self.projection.focal / self.fineness * down[bare, 0]))[:, None]
        paint[bare] += white * (_FOAM - paint[bare])
        paint += (1.0 - np.exp(-way / (_HAZE * np.median(way))))[:, None] * (_SKYLINE - paint)
        far, colors = np.full(len(pixel), np.inf), np.zeros((len(pixel), 3))
        far[seen], colors[seen] = np.where(way > _NEAR, way, np.inf), np.clip(paint, 0.0, 1.0)
        self._lay(far.reshape(shape), colors.reshape(*shape, 3))

    def _lay(self, far: Floats, colors: Floats) -> None:
        """Show a layer of shown pixels, depths [m] and colours, where it is in front of what is drawn."""
        far, colors = (one.repeat(self.fineness, 0).repeat(self.fineness, 1) for one in (far, colors))
        front = far < self.depth.reshape(far.shape)
        self.depth.reshape(far.shape)[front] = far[front]
        self.image[front] = colors[front]

    def water(self, points: Floats, spacing: float, color: Color, clearness: float) -> None:
        """Draw clear water of particles at points (N, 3) [m], ``spacing`` [m] apart; light reaches ``clearness`` [m] far."""
        thickness = np.zeros(self.height * self.width)
        surface = np.full(self.height * self.width, np.inf)
        for pixel, depth, bulge in self._splats(points, 0.5 * spacing):
            before = depth < self.depth[pixel]
            chord = _SPHERE_FILL * spacing * bulge[before]
            np.add.at(thickness, pixel[before], chord)  # a sum over the whole picture would take most of the time
            np.minimum.at(surface, pixel[before], depth[before])
        blur = min(0.35 * max(1.0, self.projection.pixels(spacing, points)), _LARGEST_BLUR * self.fineness)
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

    def _fill(self, pixels: Floats, depth: Floats, color: Floats) -> None:
        """Fill triangles (F, 3, 2) [pixels] at depths (F, 3) [m] with colours (F, 3) where they are in front, some at a time."""
        lower = np.maximum(np.floor(pixels.min(axis=1)), 0).astype(np.int64)
        upper = np.minimum(np.ceil(pixels.max(axis=1)), [self.width, self.height]).astype(np.int64)
        (x0, y0), (x1, y1), (x2, y2) = np.moveaxis(pixels, 0, -1)
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        seen = np.flatnonzero((upper > lower).all(axis=1) & (depth > 2.0 * _NEAR).all(axis=1) & (np.abs(area) > 1e-9))
        size = (upper - lower)[seen]
        portions = np.cumsum(size.prod(axis=1)) // _CANDIDATES
        for some in np.split(np.arange(len(seen)), np.flatnonzero(np.diff(portions)) + 1):
            count = size[some].prod(axis=1)
            place = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
            own = np.repeat(some, count)
            at = lower[seen[own]] + np.column_stack([place % size[own, 0], place // size[own, 0]])
            self._show(at, seen[own], (pixels, depth, area), color)

    def _show(
        self,
        at: npt.NDArray[np.int64],
        face: npt.NDArray[np.int64],
        shape: tuple[Floats, Floats, Floats],
        color: Floats,
    ) -> None:
        """Colour pixels (P, 2) that lie in their triangles (P,) and in front; the reciprocal of depth is linear over the picture."""
        pixels, depth, area = shape
        away = pixels[face] - (at + 0.5)[:, None]
        ahead, behind = away[:, [1, 2, 0]], away[:, [2, 0, 1]]
        part = (ahead[..., 0] * behind[..., 1] - behind[..., 0] * ahead[..., 1]) / area[face, None]
        inside = np.flatnonzero((part >= 0.0).all(axis=1))
        far = 1.0 / (part[inside] / depth[face[inside]]).sum(axis=1)
        number = at[inside, 1] * self.width + at[inside, 0]
        front = np.flatnonzero(far < self.depth[number])
        order = front[np.argsort(-far[front])]  # the nearest is set last, and stays
        self.depth[number[order]] = far[order]
        self.image.reshape(-1, 3)[number[order]] = np.clip(color[face[inside[order]]], 0.0, 1.0)


def on_grid(surface: SurfaceFrame, values: Floats, places: Floats) -> Floats:
    """Interpolate values, on the lines of a surface's grid or evenly between them, to places (K, 2) [m]; beyond it they go on."""
    lines = [
        np.interp(places[:, axis], at, np.linspace(0.0, values.shape[axis] - 1.0, len(at)))
        for axis, at in enumerate((surface.x, surface.y))
    ]
    return np.asarray(map_coordinates(values, lines, order=1, mode="nearest"))


def _in_box(surface: SurfaceFrame, image: npt.NDArray[np.uint8] | None, color: Color, places: Floats) -> Floats:
    """Return the colours (K, 3) from 0 to 1 of places (K, 2) [m]: of the image in the surface's box, else the one colour."""
    paint = np.tile(np.array(color[:3]) / 255.0, (len(places), 1))
    if image is None:
        return paint
    low, high = np.array(surface.box[:2]), np.array(surface.box[2:])
    part = (places - low) / (high - low)
    inside = ((part >= 0.0) & (part < 1.0)).all(axis=1)
    lines = (part[inside] * image.shape[:2] * FINER - 0.5).T
    for channel in range(3):
        smooth = zoom(image[..., channel] / 255.0, FINER, prefilter=False, mode="nearest", grid_mode=True)  # no steps
        paint[inside, channel] = map_coordinates(smooth, lines, order=1, mode="nearest")
    return paint
