"""Currents that differ from place to place, from CF NetCDF in its classic format: velocities on a grid of latitudes and longitudes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from oilsim.sea.stream import StreamTable
from recordings.model.tangent_plane import longitude_latitude
from scenarios.schema.run_settings import SiteSettings
from scenarios.setup.at_sea.flow_columns import Column, FlowFileError, velocity_of
from scenarios.setup.at_sea.flow_files import OF_DAMAGE, STANDARD_NAMES, attribute, present, since, start_of

if TYPE_CHECKING:
    pass

Double = NDArray[np.float64]
AXES = ("longitude", "latitude")


def read_stream(path: Path, site: SiteSettings | None, duration: float) -> StreamTable | None:
    """Read the currents on a grid that a run of `duration` [s] needs; times [s] count from its start. None for a file without a grid.

    Raises FlowFileError with what is wrong with the grid; what is no NetCDF, or damaged, is left to `flow_files.read_flow` to refuse.
    """
    from scipy.io import netcdf_file  # for those who have such a file

    try:
        with netcdf_file(path, "r", mmap=False, maskandscale=True) as file:
            named = {attribute(one, "standard_name"): one for one in file.variables.values()}
            axes = {name: one for name in AXES if (one := named.get(name)) is not None and one[:].size > 1}
            velocities = {
                STANDARD_NAMES["current"][name]: one for name, one in named.items() if name in STANDARD_NAMES["current"]
            }
            if len(axes) < 2 or len(velocities) != 2 or "time" not in named:
                return None
            return _stream_of(named["time"], axes, velocities, site, duration)
    except FlowFileError:
        raise
    except OF_DAMAGE:
        return None


def _stream_of(
    time: Any, axes: Mapping[str, Any], velocities: Mapping[str, Any], site: SiteSettings | None, duration: float
) -> StreamTable:
    """Build the table from the variables of a file."""
    if site is None:
        raise FlowFileError(
            ["has a grid of latitudes and longitudes, allowed: only with [site], which says where they lie"]
        )
    texts = list[str]()
    column = Column("variable 'time'", attribute(time, "units"), present(time).ravel())
    times = since(column, attribute(time, "calendar"), start_of(site), texts).values
    lines = {name: present(one).ravel() for name, one in axes.items()}
    turn = np.remainder(lines["longitude"] - site.longitude + 180.0, 360.0) - 180.0  # the shorter way around the Earth
    lines["longitude"] = site.longitude + turn
    order = [np.argsort(lines[name]) for name in AXES]
    wanted = [np.ravel(one.dimensions)[0] for one in (axes[name] for name in AXES)]
    fields = {name: _ordered(name, one, [time.dimensions[0], *wanted], texts) for name, one in velocities.items()}
    if texts:
        raise FlowFileError(texts)
    rows = _rows(times, duration)
    fields = {name: one[rows][:, order[0]][:, :, order[1]] for name, one in fields.items()}
    dry = ~np.isfinite(list(fields.values())).all(axis=(0, 1))
    shape = next(iter(fields.values())).shape
    columns = {
        name: Column(f"variable {name!r}", attribute(velocities[name], "units"), np.where(dry, 0.0, one).ravel())
        for name, one in fields.items()
    }
    values = velocity_of({**columns, "time": column}, site.bearing).reshape(*shape, 2)
    values[:, dry] = np.nan
    return _placed(times[rows], [lines[name][one] for name, one in zip(AXES, order, strict=True)], values, site)


def _ordered(name: str, variable: Any, dimensions: list[str], texts: list[str]) -> Double:
    """Return a variable with its dimensions in this order, without others of a length of one."""
    values, own = present(variable), list(variable.dimensions)
    for number in reversed(range(len(own))):
        if own[number] not in dimensions and values.shape[number] == 1:
            values = values.squeeze(number)
            del own[number]
    if sorted(own) != sorted(dimensions):
        texts.append(
            f"variable {name!r} has the dimensions {', '.join(own)}, allowed: {', '.join(dimensions)}, and others of one value"
        )
        return values
    return values.transpose([own.index(one) for one in dimensions])


def _rows(times: Double, duration: float) -> slice:
    """Return the rows that a run needs; FlowFileError for times that do not rise or do not hold it."""
    if times.size < 2 or not (np.diff(times) > 0.0).all():
        raise FlowFileError(["has times that do not rise, allowed: two or more that do"])
    if times[0] > 0.0 or times[-1] < duration:
        span = f"from {times[0]:g} to {times[-1]:g} s"
        raise FlowFileError([f"holds the times {span}, allowed: a file that holds the run, from 0 to {duration:g} s"])
    last = min(int(np.searchsorted(times, duration)), times.size - 1)
    first = min(int(np.searchsorted(times, 0.0, "right")) - 1, last - 1)
    return slice(first, last + 1)


def _placed(times: Double, lines: list[Double], values: Double, site: SiteSettings) -> StreamTable:
    """Return the table where the site says; FlowFileError for a grid that does not hold it, or that has no water there."""
    places = np.array([[0.0, 0.0], [1e3, 0.0], [0.0, 1e3]])
    degrees = np.stack(longitude_latitude(site.recorded, places), axis=-1)
    for name, line, own in zip(AXES, lines, degrees[0], strict=True):
        if not np.isfinite(line).all() or not (np.diff(line) > 0.0).all():
            raise FlowFileError([f"variable {name!r} has no rising values, allowed: one line of each {name}"])
        if not line[0] <= own <= line[-1]:
            raise FlowFileError(
                [f"has a {name} from {line[0]:.6g} to {line[-1]:.6g}, allowed: a grid around [site], {own:.6g}"]
            )
    found = StreamTable(times, (lines[0], lines[1]), degrees[0], (degrees[1:] - degrees[0]).T / 1e3, values)
    if not np.isfinite(found.at_origin()).all():
        raise FlowFileError(["has no water at the [site], allowed: a grid with values there at all times of the run"])
    return found
