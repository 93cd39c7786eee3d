"""`oilsim export`: write a recording for far-field models, maps and ParaView, or as a film."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.running.output_paths import require_apart, require_writable
from scenarios.text.problems import DONE, Problem, ScenarioError

if TYPE_CHECKING:
    from recordings.model.exercise import Site
    from recordings.replay.recording import Replay

_OUTPUTS = ("netcdf", "geojson", "vtk", "film")


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser(
        "export", help="write a recording for far-field oil models, maps or ParaView, or as a film"
    )
    parser.add_argument("recording", type=Path, metavar="FILE", help="a recording (.rrd)")
    parser.add_argument(
        "--netcdf", type=Path, metavar="FILE.nc", help="write the oil particles for GNOME and OpenDrift"
    )
    parser.add_argument(
        "--geojson", type=Path, metavar="FILE.geojson", help="write slick outlines, booms and tracks for maps"
    )
    parser.add_argument("--vtk", type=Path, metavar="DIR", help="write particles and bodies for ParaView")
    parser.add_argument(
        "--film",
        type=Path,
        metavar="FILE.gif",
        help="draw a film of ten seconds, .gif or .webp, in the look of --picture",
    )
    parser.add_argument(
        "--every", type=float, metavar="S", help="shortest time between exported frames [s] (default: every frame)"
    )
    parser.add_argument("--lost-only", action="store_true", help="in NetCDF: only oil that booms have lost")
    parser.add_argument("--particles", action="store_true", help="in GeoJSON: the particles too, beside the outlines")
    parser.add_argument(
        "--site",
        metavar="LAT,LON",
        help="latitude and longitude of the world's origin [degrees] (default: the scenario's [site])",
    )
    parser.add_argument(
        "--bearing",
        type=float,
        metavar="DEG",
        help="bearing of the x axis [degrees], clockwise from north (default: the scenario's [site], else 90, east)",
    )
    parser.add_argument(
        "--start", metavar="TIME", help="date and time of the run's start (ISO 8601), for example 2026-05-01T08:00:00Z"
    )
    parser.set_defaults(command=_export)


def _export(options: argparse.Namespace) -> int:
    from scenarios.commands.options import file_errors, interval, require_some, require_used, whole_run

    require_some(options, *_OUTPUTS)
    maps = ("netcdf", "geojson")
    places = {"site": maps, "bearing": maps, "start": maps}
    require_used(options, {"every": (*maps, "vtk"), "lost_only": ("netcdf",), "particles": ("geojson",), **places})
    written = {f"--{name}": getattr(options, name) for name in _OUTPUTS}
    require_apart({"the recording": options.recording}, written)
    folder = written.pop("--vtk")
    require_writable(written, {"--vtk": folder})
    _require_film_name(options.film)
    apart = interval(options)
    replay = whole_run(options.recording)
    site = _site(options, replay) if options.netcdf or options.geojson else None
    with file_errors():
        _write(options, replay, site, apart)
        print(*filter(None, (getattr(options, name) for name in _OUTPUTS)), sep="\n")
    return DONE


def _require_film_name(film: Path | None) -> None:
    from recordings.pictures.film import FILM_ENDINGS

    if film is not None and film.suffix not in FILM_ENDINGS:
        text = f"is {str(film)!r}, allowed: a name that ends with {' or '.join(FILM_ENDINGS)}"
        raise ScenarioError([Problem("--film", text)], "oilsim")


def _write(options: argparse.Namespace, replay: Replay, site: Site | None, apart: float | None) -> None:
    if options.netcdf is not None and site is not None:
        from recordings.export.netcdf import write_netcdf

        write_netcdf(replay, options.netcdf, site, interval=apart, lost_only=options.lost_only)
    if options.geojson is not None and site is not None:
        from recordings.export.geojson import write_geojson

        write_geojson(replay, options.geojson, site, interval=apart, particles=options.particles)
    if options.vtk is not None:
        from recordings.export.vtk_files import write_vtk

        write_vtk(replay, options.vtk, interval=apart)
    if options.film is not None:
        from rich.progress import track

        from recordings.pictures.film import draw_film
        from scenarios.text.terminal import terminal

        shown = terminal(stderr=True)
        draw_film(replay, options.film, lambda images, count: track(images, "drawing the film", count, console=shown))


def _site(options: argparse.Namespace, replay: Replay) -> Site:
    """Take the place on Earth from the options, or else from the recording."""
    from recordings.model.exercise import Site

    known = replay.run.site
    if options.site is None and known is None:
        problem = "is missing, and the scenario has no [site]; allowed: LAT,LON in degrees"
        raise ScenarioError([Problem("--site", problem)], "oilsim")
    known = known or Site(latitude=0.0, longitude=0.0)
    latitude, longitude = (known.latitude, known.longitude) if options.site is None else _degrees(options.site)
    bearing = known.bearing if options.bearing is None else options.bearing
    try:
        return Site(latitude=latitude, longitude=longitude, bearing=bearing, start=options.start or known.start)
    except ValueError as error:
        raise ScenarioError([Problem("--site, --bearing, --start", f"cannot be used: {error}")], "oilsim") from error


def _degrees(text: str) -> tuple[float, float]:
    try:
        latitude, longitude = (float(part) for part in text.split(","))
    except ValueError:
        raise ScenarioError([Problem("--site", f"is {text!r}, allowed: LAT,LON in degrees")], "oilsim") from None
    return latitude, longitude
