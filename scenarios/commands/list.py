"""`oilsim list`: list the shipped scenarios by group and the oils, or show an exercise's brief."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from scenarios.exit_codes import DONE

if TYPE_CHECKING:
    from rich.console import Console

    from scenarios.scenario import Scenario

LABORATORY = "laboratory"  # group of scenarios that are no exercises


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser("list", help="list the shipped exercises and scenarios, and the oils; or show a brief")
    parser.add_argument("scenario", nargs="?", metavar="NAME-or-FILE", help="show the trainee's brief of this exercise")
    parser.add_argument("--notes", action="store_true", help="with a name: show the instructor's notes, too")
    parser.set_defaults(command=_list)


def _list(options: argparse.Namespace) -> int:
    from scenarios.commands.options.export import require_used
    from scenarios.load import load_scenario
    from scenarios.text.terminal import terminal

    require_used(options, {"notes": ("scenario",)})
    if options.scenario is not None:
        _show(terminal(), load_scenario(options.scenario).scenario, notes=options.notes)
        return DONE
    _list_scenarios(terminal())
    _list_oils(terminal())
    return DONE


def _show(console: Console, scenario: Scenario, *, notes: bool) -> None:
    """Print the brief of an exercise, and the instructor's notes."""
    from rich.text import Text

    from scenarios.text.terminal import flowing

    console.print(Text.assemble((scenario.name, "bold"), f": {scenario.title}"))
    exercise = scenario.exercise
    if exercise is None:
        console.print(flowing(scenario.text), highlight=False, markup=False)
        return
    parts = [("Learning goal", exercise.goal), ("Brief", exercise.brief)]
    for title, text in [*parts, *([("Instructor's notes", exercise.notes)] if notes else [])]:
        console.print(Text(f"\n{title}", style="bold"))
        console.print(flowing(text), highlight=False, markup=False)


def _list_scenarios(console: Console) -> None:
    from rich.table import Table
    from rich.text import Text

    from scenarios.load import library_paths, load_scenario

    groups: dict[str, list[Scenario]] = {}
    for name in library_paths():
        scenario = load_scenario(name).scenario
        groups.setdefault(LABORATORY if scenario.exercise is None else scenario.exercise.group, []).append(scenario)
    console.print(
        Text.assemble(("Scenarios", "bold"), " (run one: oilsim run NAME; its brief: oilsim list NAME; a copy to change: oilsim new NAME)")
    )  # fmt: skip
    for group in sorted(groups, key=lambda one: (one == LABORATORY, one)):
        table = Table("name", "content", "levels", "simulated", title=group, title_justify="left")
        for scenario in groups[group]:
            levels = ", ".join(scenario.levels)
            table.add_row(scenario.name, scenario.title, levels, f"{scenario.run.duration:g} s")
        console.print(table)


def _list_oils(console: Console) -> None:
    from rich.table import Table
    from rich.text import Text

    from scenarios.oils.library import SHORT_NAMES, library

    console.print(Text.assemble(("Oils", "bold"), " (all of them, and the card of one, with: oilsim oils WORD)"))
    oils = Table("name", "density [kg/m3]", "viscosity [Pa s]", "description", title="at 15 °C", title_justify="left")
    for name, (record, description) in SHORT_NAMES.items():
        oil = library()[record]
        oils.add_row(name, f"{oil.density_at(15.0):.0f}", f"{oil.viscosity_at(15.0):.3g}", description)
    console.print(oils)
