"""The outline of a slick: the area within one particle spacing of oil, as polygons."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from shapely import MultiPolygon, Polygon, buffer, orient_polygons, points, union_all

Points = npt.NDArray[np.floating]
_REACH = 1.0  # particle spacings; this is the distance of neighbours in a film, so their discs overlap
_SMOOTH = 0.1  # particle spacings; tolerance of the simplified outline


def slick_outlines(position: Points, spacing: float) -> list[list[npt.NDArray[np.float64]]]:
    """Draw polygons around particles (N, 2) [m]; each is a list of rings (K, 2) [m], the outer one counter-clockwise, then holes.

    The outline is the union of discs of one spacing around the particles, shrunk by half a spacing. Its area tends to that of the film.
    """
    discs = buffer(points(np.asarray(position, dtype=np.float64)), _REACH * spacing, quad_segs=4)
    slick = union_all(discs).buffer(-0.5 * spacing, quad_segs=4).simplify(_SMOOTH * spacing)
    slick = orient_polygons(slick)
    polygons = slick.geoms if isinstance(slick, MultiPolygon) else [slick] if isinstance(slick, Polygon) else []
    return [[np.array(ring.coords) for ring in (one.exterior, *one.interiors)] for one in polygons if not one.is_empty]
