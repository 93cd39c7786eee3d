"""The outline of a slick: the area within one particle spacing of oil, or one width of its parcels, as polygons."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from shapely import MultiPolygon, Polygon, buffer, orient_polygons, points, union_all

Points = npt.NDArray[np.floating]
_REACH = 1.0  # widths; this is the distance of neighbours in a film, so their discs overlap
_SMOOTH = 0.1  # widths; tolerance of the simplified outline


def slick_outlines(position: Points, width: npt.ArrayLike) -> list[list[npt.NDArray[np.float64]]]:
    """Draw polygons around oil at points (N, 2) [m]; each is a list of rings (K, 2) [m], the outer one counter-clockwise, then holes.

    width [m] of the square that each covers, one or (N,): the spacing of particles. The outline is the union of discs of one width around
    the points, shrunk by half of the median width. Its area tends to that of the film.
    """
    widths = np.asarray(width, np.float64)
    middle = float(np.median(widths))
    discs = buffer(points(np.asarray(position, dtype=np.float64)), _REACH * widths, quad_segs=4)
    slick = union_all(discs).buffer(-0.5 * middle, quad_segs=4).simplify(_SMOOTH * middle)
    slick = orient_polygons(slick)
    polygons = slick.geoms if isinstance(slick, MultiPolygon) else [slick] if isinstance(slick, Polygon) else []
    return [[np.array(ring.coords) for ring in (one.exterior, *one.interiors)] for one in polygons if not one.is_empty]
