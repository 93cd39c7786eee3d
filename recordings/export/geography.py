"""GeoJSON's geometry from places in degrees.

It cuts geometry where it crosses the 180th meridian, as GeoJSON wants it (RFC 7946, section 3.1.9).

Longitudes come in unwrapped, so that a slick across the meridian is one piece; each piece goes out within -180 and 180 degrees.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from shapely import LineString, MultiPolygon, Polygon, box, orient_polygons
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

Floats = npt.NDArray[np.floating]


_DIGITS = 8  # of a degree: a millimetre

Degrees = npt.NDArray[np.float64]  # (N, 2), longitude and latitude


def points(places: Degrees) -> dict[str, Any]:
    """Make a MultiPoint of places (n, 2) [degrees east, north], each brought to -180 to 180 degrees east."""
    wrapped = places.copy()
    outside = np.abs(places[:, 0]) > 180.0
    wrapped[outside, 0] = (places[outside, 0] + 180.0) % 360.0 - 180.0
    return {"type": "MultiPoint", "coordinates": _rounded(wrapped)}


def line(places: Degrees) -> dict[str, Any]:
    """Make a LineString of places (n, 2) [degrees east, north], or a MultiLineString where the 180th meridian cuts it."""
    pieces = [piece for part in _cut([places], LineString(places)) for piece in _parts(part, LineString)]
    coordinates = [_rounded(np.array(piece.coords)) for piece in pieces]
    if len(coordinates) == 1:
        return {"type": "LineString", "coordinates": coordinates[0]}
    return {"type": "MultiLineString", "coordinates": coordinates}


def polygons(outlines: Sequence[Sequence[Degrees]]) -> dict[str, Any]:
    """Make a MultiPolygon of polygons, each given as its rings (n, 2) [degrees east, north], cut at the 180th meridian."""
    if not _is_outside([ring for rings in outlines for ring in rings]):
        coordinates = [[_rounded(ring) for ring in rings] for rings in outlines]
        return {"type": "MultiPolygon", "coordinates": coordinates}
    whole = MultiPolygon([Polygon(rings[0], rings[1:]) for rings in outlines]).buffer(0.0)
    pieces = [piece for part in _cut([rings[0] for rings in outlines], whole) for piece in _parts(part, Polygon)]
    rings_of = [(one.exterior, *one.interiors) for one in orient_polygons(pieces)]
    return {
        "type": "MultiPolygon",
        "coordinates": [[_rounded(np.array(ring.coords)) for ring in rings] for rings in rings_of],
    }


def _is_outside(places: Sequence[Degrees]) -> bool:
    return any((np.abs(ring[:, 0]) > 180.0).any() for ring in places)


def _cut(places: Sequence[Degrees], whole: BaseGeometry) -> Iterator[BaseGeometry]:
    """Yield the part of a geometry in each turn of the Earth, brought to the first turn."""
    if not _is_outside(places):
        yield whole
        return
    west, _, east, _ = whole.bounds
    for turn in range(int(np.floor((west + 180.0) / 360.0)), int(np.floor((east + 180.0) / 360.0)) + 1):
        part = whole.intersection(box(360.0 * turn - 180.0, -90.0, 360.0 * turn + 180.0, 90.0))
        yield translate(part, -360.0 * turn)


def _parts(geometry: BaseGeometry, kind: type[BaseGeometry]) -> list[Any]:
    """List the pieces of one kind in a geometry; where it only touches the meridian, a cut leaves points too."""
    return [part for part in getattr(geometry, "geoms", [geometry]) if isinstance(part, kind) and not part.is_empty]


def _rounded(places: Degrees) -> list[list[float]]:
    return [[round(longitude, _DIGITS), round(latitude, _DIGITS)] for longitude, latitude in places.tolist()]
