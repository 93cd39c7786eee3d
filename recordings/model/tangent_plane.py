"""Conversion between the world's metres and longitude and latitude, on the tangent plane at a site.

North = x cos b + y sin b and east = x sin b - y cos b, with b the bearing of x and y 90 degrees to its left. Then d latitude = north / M
and d longitude = east / (N cos latitude), with WGS 84's radii of curvature M = a (1 - e^2) / (1 - e^2 sin^2 latitude)^1.5 and
N = a / (1 - e^2 sin^2 latitude)^0.5. The error grows with the square of the distance r: about r^2 tan(latitude) / (2 N), 8 cm per square
kilometre at 45 degrees.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from recordings.model.exercise import Site

SEMI_MAJOR_AXIS = 6378137.0  # [m], WGS 84
FLATTENING = 1.0 / 298.257223563
_SQUARED_ECCENTRICITY = FLATTENING * (2.0 - FLATTENING)

Floats = npt.NDArray[np.floating]
Double = npt.NDArray[np.float64]


def _metres_per_radian(site: Site) -> tuple[float, float]:
    """Return metres east per radian of longitude, and metres north per radian of latitude, at the site."""
    latitude = np.radians(site.latitude)
    bulge = 1.0 - _SQUARED_ECCENTRICITY * np.sin(latitude) ** 2
    meridian = SEMI_MAJOR_AXIS * (1.0 - _SQUARED_ECCENTRICITY) / bulge**1.5
    return float(SEMI_MAJOR_AXIS / np.sqrt(bulge) * np.cos(latitude)), float(meridian)


def longitude_latitude(site: Site, points: Floats) -> tuple[Double, Double]:
    """Compute longitude and latitude (N,) [degrees] of points (N, 2 or more) [m] of the world; x is along the site's bearing."""
    x, y = np.asarray(points, dtype=np.float64)[:, :2].T
    sine, cosine = np.sin(np.radians(site.bearing)), np.cos(np.radians(site.bearing))
    east, north = _metres_per_radian(site)
    return (
        site.longitude + np.degrees((x * sine - y * cosine) / east),
        site.latitude + np.degrees((x * cosine + y * sine) / north),
    )


def world_points(site: Site, longitude: Floats, latitude: Floats) -> Double:
    """Compute the points (N, 2) [m] of the world at longitudes and latitudes (N,) [degrees], the shorter way around the Earth."""
    sine, cosine = np.sin(np.radians(site.bearing)), np.cos(np.radians(site.bearing))
    by_longitude, by_latitude = _metres_per_radian(site)
    turn = np.remainder(np.asarray(longitude) - site.longitude + 180.0, 360.0) - 180.0
    east, north = by_longitude * np.radians(turn), by_latitude * np.radians(np.asarray(latitude) - site.latitude)
    return np.stack([east * sine + north * cosine, north * sine - east * cosine], axis=-1)
