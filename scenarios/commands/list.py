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
    from scenarios.oils.library import SHORT_NAMES, library
    from scenarios.text.terminal import terminal

    console = terminal()
    console.print(Text.assemble(("Scenarios", "bold"), " (run one with: oilsim run NAME)"))
    table = Table("name", "content", "simulated")
    for name in library_paths():
        scenario = load_scenario(name).scenario
        table.add_row(name, scenario.title, f"{scenario.run.duration:g} s")
    console.print(table)
    console.print(Text.assemble(("Oils", "bold"), " (all of them, and the card of one, with: oilsim oils WORD)"))
    oils = Table("name", "density [kg/m3]", "viscosity [Pa s]", "description", title="at 15 °C", title_justify="left")
    for name, (record, description) in SHORT_NAMES.items():
        oil = library()[record]
        oils.add_row(name, f"{oil.density_at(15.0):.0f}", f"{oil.viscosity_at(15.0):.3g}", description)
    console.print(oils)
    return DONE
