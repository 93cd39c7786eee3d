"""GeoJSON (RFC 7946) of slick outlines, oil particles, the oil ledger, booms and tracks, for maps and geographic information systems.

Longitudes are unwrapped, so that a slick across the 180th meridian is one piece; geometry is cut there, as GeoJSON wants it (section
3.1.9), and each piece goes out within -180 and 180 degrees.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from shapely import LineString, MultiPolygon, Polygon, box, buffer, orient_polygons, points, union_all
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

from recordings.export.chosen import fates, oil_frames
from recordings.files.writing import write_whole
from recordings.model.entity_paths import VESSELS, body_group
from recordings.model.exercise import Site
from recordings.model.tangent_plane import longitude_latitude
from recordings.replay.recording import Replay

Degrees = npt.NDArray[np.float64]  # (N, 2), longitude and latitude
Points = npt.NDArray[np.floating]
_REACH = 1.0  # widths; this is the distance of neighbours in a film, so their discs overlap
_DIGITS = 8  # of a degree: a millimetre
_SMOOTH = 0.1  # widths; tolerance of the simplified outline


def write_geojson(
    replay: Replay, path: Path, site: Site, *, interval: float | None = None, particles: bool = False
) -> int:
    """Write outlines and, if asked for, particles ``interval`` [s] apart, each fate by itself; return the number of features.

    A feature without a place has the rows of the oil ledger at each of these instants, also of the oil that is gone.
    """
    features = [*_tracks(replay, site)]
    names = fates(replay)
    for frame in oil_frames(replay, interval):
        stamp = {"time_s": frame.time, "time": site.date_at(frame.time).isoformat()}
        if frame.ledger:
            rows = {f"{name.replace('/', '_')}_m3": volume for name, volume in frame.ledger.items()}
            features.append(_feature(None, stamp | {"kind": "ledger"} | rows))
        for code in np.unique(frame.fate).tolist():
            chosen = frame.fate == code
            places = frame.position[chosen]
            facts = stamp | {"fate": names[code], "fate_code": code, "volume_m3": float(frame.volume[chosen].sum())}
            if particles:
                geometry = _points(_degrees(site, places))
                features.append(_feature(geometry, facts | {"kind": "particles"}))
            outlines = slick_outlines(places[:, :2], frame.width[chosen])
            geometry = _polygons([[_degrees(site, ring) for ring in polygon] for polygon in outlines])
            features.append(_feature(geometry, facts | {"kind": "slick"}))
    collection = {"type": "FeatureCollection", "features": features}
    write_whole(path, json.dumps(collection))
    return len(features)


def _tracks(replay: Replay, site: Site) -> Iterator[dict[str, Any]]:
    """Yield the tracks of the vessels, and the lines of the booms at the last frame."""
    for name, series in replay.bodies.items():
        if body_group(name) == VESSELS and len(series.time) > 1:
            geometry = _line(_degrees(site, series.pose[:, :2]))
            yield _feature(geometry, {"kind": "track", "vessel": name.partition("/")[2]})
    for boom in replay.run.booms:
        places = [replay.bodies[name].pose[-1, :2] for name in boom.segments if name in replay.bodies]
        if len(places) > 1:
            geometry = _line(_degrees(site, np.array(places)))
            yield _feature(geometry, {"kind": "boom", "boom": boom.name})


def _feature(geometry: dict[str, Any] | None, properties: dict[str, Any]) -> dict[str, Any]:
    return {"type": "Feature", "geometry": geometry, "properties": properties}


def _degrees(site: Site, points: Points) -> Degrees:
    """Longitude, latitude (N, 2) of points (N, 2 or more) [m]."""
    return np.column_stack(longitude_latitude(site, points))


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


def _points(places: Degrees) -> dict[str, Any]:
    """Make a MultiPoint of places (n, 2) [degrees east, north], each brought to -180 to 180 degrees east."""
    wrapped = places.copy()
    outside = np.abs(places[:, 0]) > 180.0
    wrapped[outside, 0] = (places[outside, 0] + 180.0) % 360.0 - 180.0
    return {"type": "MultiPoint", "coordinates": _rounded(wrapped)}


def _line(places: Degrees) -> dict[str, Any]:
    """Make a LineString of places (n, 2) [degrees east, north], or a MultiLineString where the 180th meridian cuts it."""
    pieces = [piece for part in _cut([places], LineString(places)) for piece in _parts(part, LineString)]
    coordinates = [_rounded(np.array(piece.coords)) for piece in pieces]
    if len(coordinates) == 1:
        return {"type": "LineString", "coordinates": coordinates[0]}
    return {"type": "MultiLineString", "coordinates": coordinates}


def _polygons(outlines: Sequence[Sequence[Degrees]]) -> dict[str, Any]:
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
