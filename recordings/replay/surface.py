"""The recorded surface of the sea, and the oil on it, at single instants."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from recordings import entity_paths
from recordings.replay.columns import read_rows
from recordings.replay.recording import Replay
from recordings.surface import SurfaceFrame

_KEPT = {"position": "Mesh3D:vertex_positions", "image": "Mesh3D:albedo_texture_buffer", "box": "box"}


@dataclass(frozen=True, kw_only=True, eq=False)
class DrawnSea:
    """The sea at one instant: its surface, and the colours (R, C, 3) of water and oil in the surface's box; None without oil."""

    surface: SurfaceFrame
    image: npt.NDArray[np.uint8] | None


def seas_at(replay: Replay, indices: Sequence[int]) -> dict[int, DrawnSea]:
    """Return the sea at some steps, or as last recorded before them; steps without one are left out."""
    shape: list[int] = []
    is_clear = False
    rows: dict[str, dict[int, npt.NDArray[np.generic]]] = {name: {} for name in _KEPT}
    for _, chunk in replay.chunks(f"/{entity_paths.SURFACE}"):
        if (lines := read_rows(chunk, "shape")) is not None:
            shape = [int(number) for number in lines.values]
        if (clear := read_rows(chunk, "clear")) is not None:
            is_clear = bool(clear.values[0])
        for name, component in _KEPT.items():
            if (found := read_rows(chunk, component)) is not None:
                rows[name] |= dict(zip(found.index.tolist(), found.split(), strict=True))
    seas = {}
    for index in indices if shape else ():
        position, box, image = (_last(rows[name], index) for name in ("position", "box", "image"))
        if position is not None and box is not None:
            seas[index] = DrawnSea(surface=_surface(position, shape, box, is_clear), image=_image(image))
    return seas


def _last(rows: dict[int, npt.NDArray[np.generic]], index: int) -> npt.NDArray[np.generic] | None:
    """Return the last row at a step or before it; None if there is none."""
    known = sorted(rows)
    place = bisect_right(known, index) - 1
    return rows[known[place]] if place >= 0 else None


def _surface(
    position: npt.NDArray[np.generic], shape: Sequence[int], box: npt.NDArray[np.generic], is_clear: bool
) -> SurfaceFrame:
    grid = position.astype(np.float64).reshape(*shape, 3)
    low_x, low_y, high_x, high_y = (float(edge) for edge in box.ravel())
    return SurfaceFrame(
        x=grid[:, 0, 0],
        y=grid[0, :, 1],
        height=grid[..., 2].astype(np.float32),
        box=(low_x, low_y, high_x, high_y),
        is_clear=is_clear,
    )


def _image(buffer: npt.NDArray[np.generic] | None) -> npt.NDArray[np.uint8] | None:
    """Return the square image (R, R, 3) of a buffer of bytes."""
    if buffer is None:
        return None
    flat = np.asarray(buffer.ravel()[0], dtype=np.uint8)  # a row is one blob
    side = int(np.sqrt(len(flat) // 3))
    return flat.reshape(side, side, 3)
