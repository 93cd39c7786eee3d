"""Conversion of the world's metres to longitude and latitude around a site, and of simulated seconds to dates."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np
import numpy.typing as npt

from recordings.model.exercise import Site

SEMI_MAJOR_AXIS = 6378137.0  # [m], WGS 84
FLATTENING = 1.0 / 298.257223563
_SQUARED_ECCENTRICITY = FLATTENING * (2.0 - FLATTENING)

Floats = npt.NDArray[np.floating]


def longitude_latitude(site: Site, points: Floats) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Compute longitude and latitude (N,) [degrees] of points (N, 2 or more) [m] of the world; x is along the site's bearing.

    On the tangent plane at the site, north = x cos b + y sin b and east = x sin b - y cos b, with b the bearing of x and y 90 degrees to
    its left. Then d latitude = north / M and d longitude = east / (N cos latitude), with WGS 84's radii of curvature
    M = a (1 - e^2) / (1 - e^2 sin^2 latitude)^1.5 and N = a / (1 - e^2 sin^2 latitude)^0.5. The error grows with the square of the
    distance r: about r^2 tan(latitude) / (2 N), 8 cm per square kilometre at 45 degrees.
    """
    bearing, latitude = np.radians(site.bearing), np.radians(site.latitude)
    x, y = np.asarray(points, dtype=np.float64)[:, :2].T
    north = x * np.cos(bearing) + y * np.sin(bearing)
    east = x * np.sin(bearing) - y * np.cos(bearing)
    bulge = 1.0 - _SQUARED_ECCENTRICITY * np.sin(latitude) ** 2
    meridian = SEMI_MAJOR_AXIS * (1.0 - _SQUARED_ECCENTRICITY) / bulge**1.5
    normal = SEMI_MAJOR_AXIS / np.sqrt(bulge)
    return (
        site.longitude + np.degrees(east / (normal * np.cos(latitude))),
        site.latitude + np.degrees(north / meridian),
    )


def start_time(site: Site) -> datetime:
    """Return the date and time (UTC) at which simulated time began."""
    start = datetime.fromisoformat(site.start)
    return start.replace(tzinfo=UTC) if start.tzinfo is None else start.astimezone(UTC)


def date_at(site: Site, time: float) -> datetime:
    """Return the date and time (UTC) of a simulated time [s]."""
    return start_time(site) + timedelta(seconds=time)
