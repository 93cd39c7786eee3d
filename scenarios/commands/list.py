"""`oilsim list`: list the shipped scenarios and the oils."""

from __future__ import annotations

import argparse

from scenarios.exit_codes import DONE


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser("list", help="list the shipped scenarios, and the oils that a scenario may name")
    parser.set_defaults(command=_list)


def _list(_: argparse.Namespace) -> int:
    from rich.table import Table
    from rich.text import Text

    from scenarios.load import library_paths, load_scenario
    from scenarios.schema.oils import OILS
    from scenarios.text.terminal import terminal

    console = terminal()
    console.print(Text.assemble(("Scenarios", "bold"), " (run one with: oilsim run NAME)"))
    table = Table("name", "content", "simulated")
    for name in library_paths():
        scenario = load_scenario(name).scenario
        table.add_row(name, scenario.title, f"{scenario.run.duration:g} s")
    console.print(table)
    said = ' at 15 °C (set oil = "NAME" in a phase; values from the ADIOS oil library)'
    console.print(Text.assemble(("Oils", "bold"), said))
    oils = Table("name", "density [kg/m3]", "viscosity [Pa s]", "description")
    for name, oil in OILS.items():
        oils.add_row(name, f"{oil.density:g}", f"{oil.dynamic_viscosity:g}", oil.description)
    console.print(oils)
    return DONE
