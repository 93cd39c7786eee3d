"""CF NetCDF of oil particles in the ragged layout of NOAA's nc_particles, which GNOME and OpenDrift read.

All particles of all instants are one after another along the dimension ``data``; ``particle_count(time)`` has the number of particles
of each instant. The file is NetCDF 3 with 64-bit offsets, which every NetCDF reader knows. Layout:
github.com/NOAA-ORR-ERD/nc_particles, draft standard 0.1.0.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.io import netcdf_file

from recordings.export.chosen import OilFrame, fates, oil_frames, oil_names
from recordings.model.exercise import Site
from recordings.model.tangent_plane import longitude_latitude
from recordings.replay.moments import seas_at
from recordings.replay.recording import Replay

_GRAMS = 1000.0  # per kilogramme
# GNOME's status codes: what is not listed is in the water
IN_WATER, STATUS = 2, {"stranded": 3, "left_the_domain": 7, "evaporated": 10, "recovered": 12}
_STATUS_IN_WORDS = {IN_WATER: "in_water", 3: "on_land", 7: "off_maps", 10: "evaporated", 12: "to_be_removed"}
Floats = npt.NDArray[np.float64]
_Attributes = dict[str, str | npt.NDArray[np.int32]]


def _flags(long_name: str, meanings: dict[int, str]) -> _Attributes:
    """Return the attributes of a variable of codes, by CF 1.8, section 3.5."""
    values = np.array(list(meanings), dtype=np.int32)
    return {"long_name": long_name, "flag_values": values, "flag_meanings": " ".join(meanings.values())}


_ATTRIBUTES: dict[str, _Attributes] = {
    "longitude": {"long_name": "longitude of the particle", "standard_name": "longitude", "units": "degrees_east"},
    "latitude": {"long_name": "latitude of the particle", "standard_name": "latitude", "units": "degrees_north"},
    "depth": {
        "long_name": "particle depth below the sea surface at its time",
        "standard_name": "depth",
        "units": "m",
        "positive": "down",
        "axis": "Z",
    },
    "mass": {"long_name": "mass of the particle", "units": "grams"},
    "density": {"long_name": "density of the oil", "units": "kg m-3"},
    "viscosity": {"long_name": "kinematic viscosity of the oil", "units": "m2 s-1"},
    "age": {"long_name": "time since the start of the recording", "units": "seconds"},
    "id": {"long_name": "particle ID"},
    "status_codes": _flags("particle status code of GNOME", _STATUS_IN_WORDS),
}


def write_netcdf(
    replay: Replay, path: Path, site: Site, *, interval: float | None = None, lost_only: bool = False
) -> int:
    """Write the oil ``interval`` [s] apart, or in every recorded frame; return the number of instants.

    With ``lost_only``, particles that no boom has lost are left out: the escaped oil is the oil that drifts on. The rows of the oil ledger,
    which also has the oil that is gone, are variables over time.
    """
    frames = list(oil_frames(replay, interval, lost_only=lost_only))
    with netcdf_file(path, "w", version=2) as file:
        _write_header(file, replay, site)
        file.createDimension("time", len(frames))
        file.createDimension("data", sum(len(frame.id) for frame in frames))
        time = file.createVariable("time", "d", ("time",))
        time[:] = np.array([frame.time for frame in frames])
        start = site.date_at(0.0).replace(tzinfo=None)
        _describe(
            time, {"units": f"seconds since {start.isoformat()}", "standard_name": "time", "calendar": "standard"}
        )
        count = file.createVariable("particle_count", "i", ("time",))
        count[:] = np.array([len(frame.id) for frame in frames], dtype=np.int32)
        ragged = {"ragged_row_count": "particle count at nth timestep", "sample_dimension": "data", "units": "1"}
        _describe(count, {"long_name": "number of particles in a given timestep", **ragged})
        for name, values in _columns(replay, site, frames).items():
            variable = file.createVariable(name, "d" if values.dtype.kind == "f" else "i", ("data",))
            variable[:] = values
            words = dict(enumerate(fates(replay)))
            _describe(variable, _ATTRIBUTES.get(name) or _flags("fate of the oil, lost is by a boom", words))
        for row in frames[0].ledger:
            variable = file.createVariable(f"oil_{row.replace('/', '_')}", "d", ("time",))
            variable[:] = np.array([frame.ledger.get(row, np.nan) for frame in frames])
            _describe(variable, {"long_name": f"oil ledger of the run: {row.replace('_', ' ')}", "units": "m3"})
    return len(frames)


def _columns(replay: Replay, site: Site, frames: list[OilFrame]) -> dict[str, npt.NDArray[np.generic]]:
    """Build every particle variable, with all instants one after another."""
    position = np.concatenate([frame.position for frame in frames])
    phase = np.concatenate([frame.phase for frame in frames])
    oils = [oil for name in oil_names(replay) for oil in replay.run.phases if oil.name == name]
    density = np.array([oil.rest_density for oil in oils])
    viscosity = np.array([oil.dynamic_viscosity / oil.rest_density for oil in oils])
    longitude, latitude = longitude_latitude(site, position)
    fate, status = (
        np.concatenate([frame.fate for frame in frames]),
        [STATUS.get(name, IN_WATER) for name in fates(replay)],
    )
    age = np.repeat([frame.time - frames[0].time for frame in frames], [len(frame.id) for frame in frames])
    return {
        "longitude": longitude,
        "latitude": latitude,
        "depth": np.concatenate(_depths(replay, frames)),
        "mass": _GRAMS * density[phase] * np.concatenate([frame.volume for frame in frames]),
        "density": density[phase],
        "viscosity": viscosity[phase],
        "age": age,
        "id": np.concatenate([frame.id for frame in frames]).astype(np.int32),
        "status_codes": np.array(status, dtype=np.int32)[fate],
        "fate": fate.astype(np.int32),
    }


def _depths(replay: Replay, frames: list[OilFrame]) -> list[Floats]:
    """Return the depths (N,) [m] of the oil of each frame below the surface of the water there and then.

    Oil of a run without particles floats. Particles are under the surface as last recorded; a recording without surfaces has the level of
    the still water.
    """
    if replay.run.properties.get("boxes") == "none":
        return [np.zeros(len(frame.id)) for frame in frames]
    seas = seas_at(replay, [frame.index for frame in frames])
    exercise = replay.run.exercise
    depths = []
    for frame in frames:
        place = frame.position.astype(np.float64)
        if frame.index in seas:
            surface = seas[frame.index].surface.height_at(place[:, :2])
        else:
            still = exercise.water_level if exercise else np.percentile(place[:, 2], 99.0) if len(place) else 0.0
            surface = np.full(len(place), still)
        depths.append(np.maximum(surface - place[:, 2], 0.0))
    return depths


def _write_header(file: netcdf_file, replay: Replay, site: Site) -> None:
    file.Conventions = "CF-1.8"
    file.title = f"oil particles of {replay.run.name}"
    file.source = f"oilsim {replay.run.properties.get('version_oilsim', '')}".strip()
    file.history = f"{file.source}: exported from a recording of {replay.run.name}"
    file.comment = (
        f"x axis {site.bearing:g} degrees clockwise from north at {site.latitude:.6f} N {site.longitude:.6f} E"
    )


def _describe(variable: object, attributes: Mapping[str, object]) -> None:
    for name, value in attributes.items():
        setattr(variable, name, value)
