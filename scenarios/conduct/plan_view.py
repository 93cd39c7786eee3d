"""The oil of a run as seen from above: spots with a place, a radius, a thickness and a fate."""

from __future__ import annotations

import base64

import numpy as np
from numpy.typing import NDArray

from recordings.model.frame import Frame
from scenarios.running.assembly import Assembly
from scenarios.watch.oil_spots import AFLOAT, LOST, Spots, spots_of_slick

MOST_SPOTS = 20_000  # [1] that a page draws smoothly; the cells of particles grow until they are fewer
CELL = 2.0  # [1] smallest width of a cell, in particle spacings


def oil_spots(assembly: Assembly, frame: Frame) -> Spots:
    """Return the oil afloat and ashore as spots (N, 5): x, y, radius and thickness [m], and fate.

    The frame must be that of the communication point at which the run is now.
    """
    if assembly.slick is not None:
        return spots_of_slick(assembly.slick.slick)
    fluid = assembly.fluid
    oils = [phase for name, phase in frame.phases.items() if name in assembly.description.oils]
    if not oils:
        return np.empty((0, 5), np.float32)
    places = np.concatenate([oil.position for oil in oils])[:, :2].astype(np.float64)
    ids = np.concatenate([oil.id for oil in oils])
    gone = np.concatenate([*frame.lost.values(), np.empty(0, np.uint32)])
    is_lost = np.isin(ids, gone)
    cell, volume = CELL * assembly.description.particle_spacing, fluid.config.rest_volume
    return np.concatenate(
        [
            spots_of_particles(places[~is_lost], volume, cell, AFLOAT),
            spots_of_particles(places[is_lost], volume, cell, LOST),
        ]
    )


def spots_of_particles(places: NDArray[np.float64], volume: float, cell: float, fate: int) -> Spots:
    """Return one spot for each square cell [m] with oil in it, (N, 5); its thickness is the oil's volume over the cell's area.

    places (M, 2) [m] of particles of `volume` [m3]. Cells are doubled until there are at most `MOST_SPOTS`.
    """
    while True:
        cells, counts = np.unique(np.floor(places / cell).astype(np.int64), axis=0, return_counts=True)
        if len(cells) <= MOST_SPOTS:
            break
        cell *= 2.0
    shape = np.ones(len(cells))
    columns = [(cells + 0.5) * cell, cell / np.sqrt(np.pi) * shape, counts * volume / cell**2, fate * shape]
    return np.column_stack(columns).astype(np.float32)


def as_text(array: NDArray[np.float32]) -> str:
    """Return the bytes of spots (N, 5), little-endian float32, as base64."""
    return base64.b64encode(np.ascontiguousarray(array, dtype="<f4").tobytes()).decode("ascii")
