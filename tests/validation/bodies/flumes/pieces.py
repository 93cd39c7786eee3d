"""Runs of many hours in pieces: saved states, the time at which a piece ends, and the options that say so."""

from __future__ import annotations

import argparse
import math
import os
import pickle
import time
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from booms.losses.liquids import ASSUMED_TENSION
from oilsim import Phase
from oilsim.core.phases import weak_depth
from oilsim.core.quantity import require
from oilsim.slick.oil import Oil
from scenarios.oils.library import oil_named
from tests.validation.bodies.flumes.tables import Row
from tests.validation.scenes import GRAVITY


@dataclass
class Piece:
    """One piece of a long run, in wall time from its making on.

    seconds   [s] after which the piece ends
    interval  [s] between two saved states
    say       called with each line about how far the run is
    """

    seconds: float = math.inf
    interval: float = math.inf
    say: Callable[[str], None] = lambda line: None
    _begin: float = field(default_factory=lambda: time.monotonic(), init=False)
    _spent: float = field(default_factory=lambda: time.process_time(), init=False)
    _saved: float = field(default_factory=lambda: time.monotonic(), init=False)

    @property
    def is_over(self) -> bool:
        """Whether the run has to end, after a last saved state."""
        return time.monotonic() - self._begin >= self.seconds

    def asks_to_save(self) -> bool:
        """Return whether the state has to be saved now, and begin the next interval if so."""
        due = time.monotonic() - self._saved >= self.interval
        if due:
            self._saved = time.monotonic()
        return due

    def progress(self, flow_seconds: float, flow_left: float) -> str:
        """Tell what a second of flow has cost in this piece, and what the rest will: flow done and left [s].

        In processor time of all threads, which does not depend on what else the machine does.
        """
        if flow_seconds <= 0.0:
            return "nothing computed in this piece"
        cost = (time.process_time() - self._spent) / flow_seconds
        left = cost * flow_left / 3600.0
        return f"{cost:.2g} s of processor time for each second of flow, {left:.1f} h of it left at most"


def save(path: Path, state: dict[str, Any]) -> None:
    """Write a state to `path`, whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    whole = path.with_suffix(".writing")
    whole.write_bytes(pickle.dumps(state))
    os.replace(whole, path)


def saved(path: Path) -> dict[str, Any] | None:
    """Return the state that `save` wrote, None where there is none; the file must be our own, since pickles can run code."""
    return pickle.loads(path.read_bytes()) if path.exists() else None


def rows_of(state: dict[str, Any], kind: type[Row], path: Path) -> list[Row]:
    """Return the rows of a saved state as `kind`, a dataclass.

    Raises:
        SystemExit: the state at `path` was saved by a version whose rows have other columns.
    """
    wanted = {one.name for one in fields(kind)}
    for row in state["rows"]:
        if unlike := sorted(wanted ^ row.keys()):
            raise SystemExit(
                f"{path}: saved by another version, whose rows differ in {', '.join(unlike)}, "
                "allowed: a state of this version; remove the file to begin again, or choose another --folder"
            )
    return [kind(**row) for row in state["rows"]]


def tension_of(text: str) -> float:
    """Return an interfacial tension [N/m] from a number, or from the name of an oil of the library whose tension was measured."""
    try:
        tension = float(text)
    except ValueError:
        tension = _of_library(text)
    try:
        require("oil", Oil, {"interfacial_tension": tension})
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
    return tension


def _of_library(name: str) -> float:
    try:
        tension = oil_named(name).interfacial_tension
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
    if tension is None:
        raise argparse.ArgumentTypeError(f"{name!r} has no measured interfacial tension, allowed: a number [N/m]")
    return tension


def add_options(parser: argparse.ArgumentParser, oils: tuple[float, ...], folder: Path) -> None:
    """Add the options that the long runs share."""
    parser.add_argument("--oil", type=float, choices=oils, required=True, help="density [kg/m3]")
    parser.add_argument("--resolution", type=int, required=True, help="spacings of draft")
    parser.add_argument(
        "--tension", type=tension_of, nargs="?", default=0.0, const=ASSUMED_TENSION, metavar="N/M or OIL",
        help=f"interfacial tension [N/m], or an oil of the library that has it; {ASSUMED_TENSION:g} if neither is given, "
        "none without this option",
    )  # fmt: skip
    parser.add_argument(
        "--balanced",
        action="store_true",
        help="well-balanced water, as in windows: fewer steps, and drops rise more freely",
    )
    parser.add_argument("--minutes", type=float, default=math.inf, help="of this piece; default until the end")
    parser.add_argument("--save-every", type=float, default=5.0, help="minutes between saved states")
    parser.add_argument("--keep", action="store_true", help="put the rows into the table that is committed")
    parser.add_argument("--folder", type=Path, default=folder, help="of tables and saved states")
    parser.add_argument("--threads", type=int, default=None, help="threads; default all cores")


def read_options(parser: argparse.ArgumentParser, draft: float) -> argparse.Namespace:
    """Return the options of the command line; an error for a spacing that interfaces do not bear under the draft [m]."""
    options = parser.parse_args()
    if not options.resolution >= 2:
        parser.error(f"--resolution is {options.resolution}, allowed: 2 or more spacings of draft")
    spacing = draft / options.resolution
    oil = Phase(name="oil", rest_density=options.oil, interfacial_tension=options.tension)
    weak = weak_depth([oil], spacing, GRAVITY)
    if weak > 0.5 * spacing:
        parser.error(
            f"--resolution is {options.resolution}: the pull of {options.tension:g} N/m passes the pressure down to {1e3 * weak:.2g} mm, "
            f"deeper than the uppermost particles of {1e3 * spacing:.2g} mm, allowed: coarser spacings"
        )
    return options


def piece_of(options: argparse.Namespace) -> Piece:
    """Return the piece that the options ask for; it prints what it has to say."""
    return Piece(60.0 * options.minutes, 60.0 * options.save_every, lambda line: print(line, flush=True))
