"""`oilsim signals`: list the signals of a scenario, to which FMUs can be connected and which an exported FMU has."""

from __future__ import annotations

import argparse

from scenarios.commands.options.scenario import add_scenario, overrides
from scenarios.exit_codes import DONE


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser("signals", help="list the signals of a scenario: its inputs and outputs for FMUs")
    add_scenario(parser)
    parser.set_defaults(command=_signals)


def _signals(options: argparse.Namespace) -> int:
    from rich.table import Table

    from scenarios.load import load_scenario
    from scenarios.signals.signal_table import signals_of
    from scenarios.text.terminal import terminal

    scenario = load_scenario(options.scenario, overrides=overrides(options), demo=options.demo).scenario
    table = Table("signal", "unit", "direction")
    for signal in signals_of(scenario).values():
        table.add_row(
            signal.name, signal.unit, f"input, {signal.start:g} at the start" if signal.is_input else "output"
        )
    terminal().print(table)
    return DONE
