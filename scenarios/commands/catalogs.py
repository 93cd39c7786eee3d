"""`oilsim booms | vessels | skimmers | oils`: the catalogues, and the card of one entry."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

from oilsim.core.physical_constants import POUND_FORCE
from scenarios.oils.properties import ZERO_CELSIUS
from scenarios.text.problems import DONE

if TYPE_CHECKING:
    from rich.table import Table

    from oilsim.core.catalogue import CatalogueEntry
    from scenarios.oils.properties import OilRecord


class Shelf(NamedTuple):
    """A catalogue that a command lists: the module that reads it, what its entries are, and the figures of the list."""

    module: str
    what: str
    columns: tuple[str, ...]


SHELVES = {
    "booms": Shelf("booms.boom", "boom", ("skirt_depth", "freeboard", "strength")),
    "vessels": Shelf("vessels.hull_size", "vessel", ("length", "beam", "draft", "bollard_pull", "speed_kn")),
    "skimmers": Shelf(
        "booms.recovery.skimmer", "skimmer", ("kind", "nameplate", "recovery_efficiency", "swath", "storage")
    ),
}
UNITS = {
    "nameplate": "{:g} m3/h of fluid",
    "storage": "{:g} m3",
    "recovery_efficiency": "{:.3g} of the fluid is oil",
    "buoyancy_to_weight": "{:g}:1, gross",
    "ballast_fraction": "{:.0%} of the mass at the skirt's foot",
    "maximum_speed_kn": "{:g} kn across the boom",
    "speed_kn": "{:g} kn",
    "speed_ratio": "{:g} of the speed outside",
    "volume": "{:g} m3 of oil",
}  # figures whose unit is neither metres nor newtons
FORCES = ("strength", "connector_strength", "bollard_pull")


def register_equipment(commands: argparse._SubParsersAction) -> None:
    """Add the parsers of the subcommands that list equipment to `commands`."""
    for command, shelf in SHELVES.items():
        parser = commands.add_parser(
            command, help=f"list the {command} that a scenario may name, or show the card of one"
        )
        parser.add_argument("name", metavar="NAME", nargs="?", help=f"name of a {shelf.what}")
        parser.set_defaults(command=_equipment, shelf=command)


def _equipment(options: argparse.Namespace) -> int:
    from scenarios.text.problems import Problem, ScenarioError, unknown
    from scenarios.text.terminal import terminal

    shelf = SHELVES[options.shelf]
    known: Mapping[str, CatalogueEntry] = import_module(shelf.module).catalogue()
    if options.name is None:
        terminal().print(_list(known.values(), shelf, options.shelf))
    elif options.name in known:
        terminal().print(_card(known[options.name]))
    else:
        text = f"is {options.name!r}, which {unknown(options.name, known, f'{shelf.what} of the catalogue')}"
        raise ScenarioError([Problem("NAME", text)], "oilsim")
    return DONE


def _list(entries: Iterable[CatalogueEntry], shelf: Shelf, command: str) -> Table:
    from rich.table import Table

    heads = [name.removesuffix("_kn").removesuffix("_depth").replace("_", " ") for name in shelf.columns]
    table = Table("name", shelf.what, *heads)
    for entry in entries:
        table.add_row(
            entry.name, entry.title, *(_told(name, getattr(entry, name), short=True) for name in shelf.columns)
        )
    table.caption = f'in a scenario: {shelf.what} = "NAME"; sources with: oilsim {command} NAME'
    return table


def _card(entry: CatalogueEntry) -> Table:
    from rich.table import Table

    card = Table(show_header=False, title=f"{entry.name}: {entry.title}", title_justify="left")
    for path, value in _figures(entry):
        name = path.rpartition(".")[2]
        mark = " (assumed)" if path in entry.assumed else ""
        card.add_row(path.removesuffix("_kn").replace(".", " ").replace("_", " "), _told(name, value) + mark)
    card.add_row("source", entry.source)
    return card


def _figures(entry: Any, above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the figures of an entry that are known, and of its parts, by name."""
    for item in fields(entry):
        value = getattr(entry, item.name)
        if is_dataclass(value):
            yield from _figures(value, f"{item.name}.")
        elif value not in (None, "") and item.name not in ("name", "title", "source", "assumed"):
            yield above + item.name, value


def _told(name: str, value: Any, *, short: bool = False) -> str:
    """Say a figure with its unit; in short, without what the name says."""
    if value is None or isinstance(value, str):
        return value or ""
    if name in FORCES:
        told = f"{value / 1e3:.3g} kN"
        return told if short else f"{told} ({value / POUND_FORCE:,.0f} lb)"
    told = UNITS.get(name, "{:.3g} m").format(value)
    return told.partition(" of ")[0] if short else told


def register_oils(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser(
        "oils", help="search the oils that a scenario may name; one that is found alone is shown as a card"
    )
    parser.add_argument("search", metavar="SEARCH", nargs="*", help="words of a name, record, place or product")
    parser.add_argument("--temperature", type=float, default=15.0, metavar="C", help="degrees Celsius (default: 15)")
    parser.add_argument(
        "--evaporated", type=float, default=0.0, metavar="F", help="share of the mass that has evaporated"
    )
    parser.add_argument("--water", type=float, default=0.0, metavar="Y", help="share of water in the emulsion's volume")
    parser.add_argument("--refused", action="store_true", help="list the records and values that were refused, and why")
    parser.set_defaults(command=_oils)


def _oils(options: argparse.Namespace) -> int:
    from scenarios.oils.library import SHORT_NAMES, fault_of, oil_named, search
    from scenarios.text.terminal import terminal

    console = terminal()
    _check(options)
    if options.refused:
        console.print(_refused())
        return DONE
    text = " ".join(options.search)
    if text and not fault_of(text):
        console.print(_card_of_oil(oil_named(text), options))
        return DONE
    found = search(options.search) if text else [oil_named(name) for name in SHORT_NAMES]
    if len(found) == 1:
        console.print(_card_of_oil(found[0], options))
        return DONE
    if not found:
        from scenarios.text.problems import Problem, ScenarioError

        fault = f"is {text!r}, which no oil of the library has, allowed: words of a name, record, place or product, as in oilsim oils maya"
        raise ScenarioError([Problem("SEARCH", fault)], "oilsim oils")
    console.print(_list_of_oils(found, options))
    head = (
        f"{len(found)} oils" if text else "the oils with a short name; search the whole library with oilsim oils WORD"
    )
    console.print(f'{head}; in a scenario: oil = "RECORD", short name or full name', highlight=False)
    return DONE


def _check(options: argparse.Namespace) -> None:
    """Raise ScenarioError for a state that no phase of a scenario may have."""
    from scenarios.schema.liquid import PhaseSettings
    from scenarios.text.problems import Problem, ScenarioError

    state = {"temperature": options.temperature, "evaporated": options.evaporated, "water_content": options.water}
    try:
        PhaseSettings(oil="diesel", **state)
    except ScenarioError as error:
        named = {"water_content": "--water"}
        raise ScenarioError(
            [Problem(named.get(fault.path, f"--{fault.path}"), fault.text) for fault in error.problems], "oilsim"
        ) from error


def _list_of_oils(found: list[OilRecord], options: argparse.Namespace) -> Table:
    from rich.table import Table

    from scenarios.oils.library import SHORT_NAMES

    short = {record: name for name, (record, _) in SHORT_NAMES.items()}
    table = Table("record", "name (short name)", "API", "kg/m3", "cSt", "pour point")
    for oil in found:
        table.add_row(
            oil.record,
            oil.name + (f" ({short[oil.record]})" if oil.record in short else ""),
            f"{oil.gravity:.1f}",
            f"{oil.density_at(options.temperature):.0f}",
            f"{oil.kinematic_viscosity_at(options.temperature) * 1e6:.3g}",
            "" if oil.pour_point is None else f"{oil.pour_point - ZERO_CELSIUS:.0f} °C",
        )
    table.title, table.title_justify = f"at {options.temperature:g} °C, fresh", "left"
    return table


def _card_of_oil(oil: OilRecord, options: argparse.Namespace) -> Table:
    from rich.table import Table

    from scenarios.oils.properties import emulsion_factor

    temperature, state = options.temperature, {"evaporated": options.evaporated, "water_content": options.water}
    card = Table(show_header=False, title=f"{oil.name} ({oil.record})", title_justify="left")
    density = oil.density_at(temperature, **state)
    viscosity = oil.viscosity_at(temperature, **state)
    card.add_row("place, product", ", ".join(part for part in (oil.location, oil.product) if part))
    card.add_row("state", f"{temperature:g} °C, {options.evaporated:.0%} evaporated, {options.water:.0%} water")
    card.add_row("density", f"{density:.1f} kg/m3; fresh oil {oil.gravity:.1f} °API")
    card.add_row("viscosity", f"{viscosity:.4g} Pa s = {viscosity * 1e3:.4g} cP; {viscosity / density * 1e6:.4g} cSt")
    tension = "not measured" if oil.interfacial_tension is None else f"{oil.interfacial_tension * 1e3:.1f} mN/m"
    card.add_row("interfacial tension", f"{tension} (fresh oil on water)")
    card.add_row("pour point", _pour_point(oil, temperature))
    for quantity in ("density", "viscosity"):
        card.add_row(f"{quantity} measured", _measured(oil, quantity, temperature))
    for quantity, law in (
        ("density", f"x (1 + {oil.density_gain:.3g} F)"),
        ("viscosity", f"x exp({oil.viscosity_gain:.3g} F)"),
    ):
        card.add_row(f"{quantity}, share F evaporated", f"{law}, {_origin(oil, quantity)}")
    if options.water:
        card.add_row("emulsion", f"viscosity x {emulsion_factor(options.water):.3g} (Mooney 1951)")
    card.add_row("reference", oil.reference or "none given")
    return card


def _pour_point(oil: OilRecord, temperature: float) -> str:
    if oil.pour_point is None:
        return "not measured"
    told = f"{oil.pour_point - ZERO_CELSIUS:.0f} °C (fresh oil)"
    return told + (
        ": the oil is near solid, its viscosity here means little"
        if temperature < oil.pour_point - ZERO_CELSIUS
        else ""
    )


def _measured(oil: OilRecord, quantity: str, temperature: float) -> str:
    """Say at which temperatures a quantity was measured, and how it comes to the wanted one."""
    places = oil.temperatures(quantity)
    if not places:
        return "by API gravity, and 0.8 kg/m3 a degree"
    told = "at " + ", ".join(f"{place:g}" for place in places) + " °C"
    if places[0] <= temperature <= places[-1]:
        return told
    return told + ("; extrapolated" if len(places) > 1 else "; brought to the temperature by the usual slope")


def _origin(oil: OilRecord, quantity: str) -> str:
    if oil.own_gain(quantity):
        return "from its weathered samples"
    others = sum(one.own_gain(quantity) > 0.0 for one in oil.relatives)
    return f"by {others} other records" if others else "typical"


def _refused() -> Table:
    from rich.table import Table

    from scenarios.oils.library import refusals

    table = Table("record", "name", "refused", "reason")
    for row in refusals():
        table.add_row(row["record"], row["name"], row["refused"], row["reason"])
    return table
