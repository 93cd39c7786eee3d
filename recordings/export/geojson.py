"""GeoJSON (RFC 7946) of slick outlines, oil particles, the oil ledger, booms and tracks, for maps and geographic information systems."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from shapely import MultiPolygon, Polygon, buffer, orient_polygons, points, union_all

from recordings.export import geography
from recordings.export.chosen import fates, oil_frames
from recordings.files.writing import write_whole
from recordings.model.entity_paths import VESSELS, body_group
from recordings.model.exercise import Site
from recordings.model.tangent_plane import longitude_latitude
from recordings.replay.recording import Replay

Points = npt.NDArray[np.floating]
_REACH = 1.0  # widths; this is the distance of neighbours in a film, so their discs overlap
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
                geometry = geography.points(_degrees(site, places))
                features.append(_feature(geometry, facts | {"kind": "particles"}))
            outlines = slick_outlines(places[:, :2], frame.width[chosen])
            geometry = geography.polygons([[_degrees(site, ring) for ring in polygon] for polygon in outlines])
            features.append(_feature(geometry, facts | {"kind": "slick"}))
    collection = {"type": "FeatureCollection", "features": features}
    write_whole(path, json.dumps(collection))
    return len(features)


def _tracks(replay: Replay, site: Site) -> Iterator[dict[str, Any]]:
    """Yield the tracks of the vessels, and the lines of the booms at the last frame."""
    for name, series in replay.bodies.items():
        if body_group(name) == VESSELS and len(series.time) > 1:
            geometry = geography.line(_degrees(site, series.pose[:, :2]))
            yield _feature(geometry, {"kind": "track", "vessel": name.partition("/")[2]})
    for boom in replay.run.exercise.booms if replay.run.exercise else ():
        places = [replay.bodies[name].pose[-1, :2] for name in boom.segments if name in replay.bodies]
        if len(places) > 1:
            geometry = geography.line(_degrees(site, np.array(places)))
            yield _feature(geometry, {"kind": "boom", "boom": boom.name})


def _feature(geometry: dict[str, Any] | None, properties: dict[str, Any]) -> dict[str, Any]:
    return {"type": "Feature", "geometry": geometry, "properties": properties}


def _degrees(site: Site, points: Points) -> npt.NDArray[np.float64]:
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
