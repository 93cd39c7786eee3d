"""The surface of the sea at one instant, and the oil on it as a film: plain records of numpy arrays, as in `frame`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

HEIGHT_GRID = 1.0 / 256.0  # [m] to which recorded heights are rounded; a power of two, so that the file compresses
_LIGHT = np.array([-0.45, -0.35, 0.82])  # [1] direction to the sun, about of length 1
_RELIEF = 6.0  # [1] exaggeration of slopes in the light, so that low waves are seen
_FLAT = (
    0.86  # [1] brightness of the flat sea; the steepest slopes differ from it by what is left to 1, to both sides alike
)


@dataclass(frozen=True, kw_only=True, eq=False)
class SurfaceFrame:
    """The water's surface over a grid, fine within `box` and coarser towards the horizon; ValueError for arrays of other shapes.

    x (N,), y (M,)  [m] grid lines, increasing
    height (N, M)   [m] float32, in the world
    box             [m] the part in which a film is shown: x and y from, x and y to
    is_clear        whether bodies and oil under it are seen through it, as in a tank, whose outermost lines are the water's sides; a
                    sea's hides them
    """

    x: npt.NDArray[np.float64]
    y: npt.NDArray[np.float64]
    height: npt.NDArray[np.float32]
    box: tuple[float, float, float, float]
    is_clear: bool = False

    def __post_init__(self) -> None:
        wanted = (len(self.x), len(self.y))
        if self.height.shape != wanted:
            raise ValueError(f"surface height has shape {self.height.shape}, allowed: {wanted}")

    def height_at(self, places: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return the height (P,) [m] at places (P, 2) [m], linear between grid lines; beyond the grid, that of its edge."""
        rim = 1 if self.is_clear else 0  # sides are no surface
        inner = slice(rim, -rim or None)
        x, y, height = self.x[inner], self.y[inner], self.height[inner, inner].astype(np.float64)
        (i, a), (j, b) = (_cell(lines, places[:, axis]) for axis, lines in enumerate((x, y)))
        low = (1.0 - b) * height[i, j] + b * height[i, j + 1]
        high = (1.0 - b) * height[i + 1, j] + b * height[i + 1, j + 1]
        return np.asarray((1.0 - a) * low + a * high)

    @property
    def vertices(self) -> npt.NDArray[np.float32]:
        """The grid's crossings (N M, 3) [m], along y first; heights are rounded to `HEIGHT_GRID`."""
        x, y = np.meshgrid(self.x, self.y, indexing="ij")
        height = np.round(self.height / HEIGHT_GRID) * HEIGHT_GRID
        return np.stack([x.ravel(), y.ravel(), height.ravel()], axis=-1).astype(np.float32)

    @property
    def places_in_box(self) -> npt.NDArray[np.float32]:
        """The crossings (N M, 2) [1] in the box: 0 where it begins, 1 where it ends, and there beyond it."""
        low, high = np.array(self.box[:2]), np.array(self.box[2:])
        return np.asarray(np.clip((self.vertices[:, :2] - low) / (high - low), 0.0, 1.0), dtype=np.float32)

    @property
    def brightness(self) -> npt.NDArray[np.float32]:
        """Daylight (N M,) [1] on the surface: up to 1 towards the sun, less away from it; waves fade where grid lines are far apart."""
        fade, _, *slopes = self.waves
        steep = -_RELIEF * fade * (_LIGHT[0] * slopes[0] + _LIGHT[1] * slopes[1]) / _LIGHT[2]
        light = _FLAT + (1.0 - _FLAT) * np.tanh(_FLAT / (1.0 - _FLAT) * steep)
        return np.asarray(light.ravel(), dtype=np.float32)

    @property
    def waves(self) -> npt.NDArray[np.float64]:
        """Four grids (4, N, M): how well waves are seen [1], less where lines are far apart; height [m]; slopes [1] along x and y."""
        rim = 1 if self.is_clear else 0  # sides are as the surface beside them
        inner = slice(rim, -rim or None)
        lines = (self.x[inner], self.y[inner])
        apart = [np.gradient(one) for one in lines]
        fade = np.multiply.outer(*((one.min() / one) ** 4 for one in apart))
        height = self.height[inner, inner].astype(np.float64)
        return np.array([np.pad(one, rim, mode="edge") for one in (fade, height, *np.gradient(height, *lines))])


def _cell(
    lines: npt.NDArray[np.float64], at: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """Return the cell (P,) between grid lines [m] at which places (P,) [m] lie, and how far into it (P,) [1], from 0 to 1."""
    cell = np.clip(np.searchsorted(lines, at, side="right") - 1, 0, len(lines) - 2)
    return cell, np.clip((at - lines[cell]) / (lines[cell + 1] - lines[cell]), 0.0, 1.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class FilmFrame:
    """The oil on the surface within a box: thickness (R, C) [m], rows along x and columns along y from the corner `box[:2]` [m] on."""

    thickness: npt.NDArray[np.float32]
    box: tuple[float, float, float, float]


def grid_faces(rows: int, columns: int) -> npt.NDArray[np.uint32]:
    """Return the triangles (F, 3) of a grid whose vertices are numbered row by row; F is twice its number of cells."""
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    low, high = (
        np.stack([corner, corner + columns, corner + 1], -1),
        np.stack([corner + 1, corner + columns, corner + columns + 1], -1),
    )
    return np.concatenate([low, high]).astype(np.uint32)
