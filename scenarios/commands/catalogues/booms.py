"""`oilsim booms`: list the catalogue of booms, or show the card of one."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from oilsim.physical_constants import POUND_FORCE
from scenarios.exit_codes import DONE

if TYPE_CHECKING:
    from rich.table import Table

    from booms.catalog import CatalogueBoom


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser("booms", help="list the booms that a scenario may name, or show the card of one")
    parser.add_argument("name", metavar="NAME", nargs="?", help="name of a boom")
    parser.set_defaults(command=_booms)


def _booms(options: argparse.Namespace) -> int:
    from booms.catalog import catalogue
    from scenarios.problems import Problem, ScenarioError, unknown
    from scenarios.text.terminal import terminal

    known = catalogue()
    if options.name is None:
        terminal().print(_list_of(known.values()))
    elif options.name in known:
        terminal().print(_card(known[options.name]))
    else:
        text = f"is {options.name!r}, which {unknown(options.name, known, 'boom of the catalogue')}"
        raise ScenarioError([Problem("NAME", text)], "oilsim")
    return DONE


def _list_of(entries: Iterable[CatalogueBoom]) -> Table:
    from rich.table import Table

    table = Table("name", "boom", "skirt", "freeboard", "strength")
    for entry in entries:
        strength = "" if entry.strength is None else f"{entry.strength / 1e3:.0f} kN"
        table.add_row(entry.name, entry.title, _metres(entry.skirt_depth), _metres(entry.freeboard), strength)
    table.caption = 'in a scenario: boom = "NAME"; sources with: oilsim booms NAME'
    return table


def _card(entry: CatalogueBoom) -> Table:
    from rich.table import Table

    card = Table(show_header=False, title=f"{entry.name}: {entry.title}", title_justify="left")
    numbers = {
        "skirt_depth": _metres(entry.skirt_depth),
        "freeboard": _metres(entry.freeboard),
        "buoyancy_to_weight": "" if entry.buoyancy_to_weight is None else f"{entry.buoyancy_to_weight:g}:1, gross",
        "ballast_fraction": f"{entry.ballast_fraction:.0%} of the mass at the skirt's foot",
        "section_length": _metres(entry.section_length),
        "connector": entry.connector,
        "strength": ""
        if entry.strength is None
        else f"{entry.strength / 1e3:.3g} kN ({entry.strength / POUND_FORCE:,.0f} lb)",
        "connector_strength": "" if entry.connector_strength is None else f"{entry.connector_strength / 1e3:.3g} kN",
        "maximum_speed_kn": "" if entry.maximum_speed_kn is None else f"{entry.maximum_speed_kn:g} kn across the boom",
    }
    card.add_row("kind", entry.kind)
    for name, value in numbers.items():
        if value:
            card.add_row(
                name.removesuffix("_kn").replace("_", " "), value + (" (assumed)" if name in entry.assumed else "")
            )
    for name, value in _parts(entry):
        card.add_row(name.replace(".", " ").replace("_", " "), value + (" (assumed)" if name in entry.assumed else ""))
    card.add_row("source", entry.source)
    return card


def _parts(entry: CatalogueBoom) -> Iterator[tuple[str, str]]:
    """Yield the figures of a boom for fast water, by name, in words."""
    if entry.net is not None:
        yield "net.solidity", f"{entry.net.solidity:.0%} of the area is twine"
        yield "net.mesh_opening", f"{1e3 * entry.net.mesh_opening:g} mm"
    if entry.pocket is not None:
        yield "pocket.length", f"{_metres(entry.pocket.length)} of the boom"
        yield "pocket.speed_ratio", f"{entry.pocket.speed_ratio:g} of the speed outside"
        yield "pocket.volume", f"{entry.pocket.volume:g} m3 of oil"


def _metres(length: float | None) -> str:
    return "" if length is None else f"{length:.3g} m"
