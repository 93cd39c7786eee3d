"""`oilsim check`: check a scenario and estimate the cost of a run."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from recordings.model.words import volume_in_words
from scenarios.commands.options import add_scenario, overrides
from scenarios.text.problems import DONE, Problem, ScenarioError

if TYPE_CHECKING:
    from rich.console import Console

    from scenarios.setup.cost import Cost
    from scenarios.spec.load import LoadedScenario
    from scenarios.spec.resolve import RunSpec


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser("check", help="check a scenario and estimate the memory and time that a run needs")
    add_scenario(parser)
    parser.set_defaults(command=_check)


def _check(options: argparse.Namespace) -> int:
    from scenarios.setup.cost import estimate
    from scenarios.spec.load import load_scenario
    from scenarios.spec.resolve import resolve
    from scenarios.text.terminal import terminal

    loaded = load_scenario(options.scenario, overrides=overrides(options), demo=options.demo)
    try:
        scenario = resolve(loaded.scenario)
        cost = estimate(scenario)
    except ScenarioError as error:
        raise ScenarioError(error.problems, str(loaded.path)) from error
    if not overrides(options):  # an entry that is changed may be there at the one level only
        _require_levels(options, loaded)
    _print_cost(terminal(), scenario, cost)
    return DONE


def _require_levels(options: argparse.Namespace, loaded: LoadedScenario) -> None:
    """Raise ScenarioError for levels of the scenario, other than the one that is checked, that could not be built or placed."""
    from scenarios.setup.cost import estimate
    from scenarios.spec.load import load_scenario

    problems = list[Problem]()
    for level in loaded.scenario.levels:
        try:
            if level != loaded.scenario.level:
                estimate(load_scenario(options.scenario, overrides=[f"level={level}"], demo=options.demo).scenario)
        except ScenarioError as error:
            problems += [problem.below(f"levels.{level}") for problem in error.problems]
    if problems:
        raise ScenarioError(problems, str(loaded.path))


def _print_cost(console: Console, scenario: RunSpec, cost: Cost) -> None:
    from rich.table import Table
    from rich.text import Text

    from oilsim.core.config import longest_time_step
    from scenarios.setup.cost import longest_step

    console.print(Text.assemble((scenario.name, "bold"), f": {scenario.title}"))
    table = Table(show_header=False)
    table.add_column(style="bold")
    table.add_column(justify="right")
    for phase, count in cost.particles.items() if scenario.tanks else ():
        poured = cost.emitted.get(phase, 0)
        volume = (
            f" ({volume_in_words(count * scenario.fluid.particle_spacing**3)})" if scenario.fluid.dimension == 3 else ""
        )
        table.add_row(
            f"{phase} particles", f"{count:,}{volume}" + (f", plus up to {poured:,} from pipes" if poured else "")
        )
    for name, count in cost.boundary.items():
        table.add_row(f"surface particles of {name}", f"about {count:,}")
    table.add_row("simulated", f"{scenario.run.duration:g} s in about {cost.steps:,} steps")
    if scenario.tanks:
        given, step = scenario.fluid.maximum_time_step is not None, longest_step(scenario)
        chosen = "set by fluid.maximum_time_step" if given else "by the particle spacing"
        if step < longest_time_step(scenario.fluid):
            chosen = "by the tension of interfaces"
        table.add_row("longest step", f"{1e3 * step:.3g} ms, {chosen}")
    table.add_row("memory", f"about {cost.memory / 1e9:.1f} GB")
    table.add_row(f"time with {cost.threads} threads", f"about {_duration(cost.seconds)}")
    console.print(table)
    for text in (*cost.left_out.values(), *cost.told):
        console.print(text, highlight=False, markup=False)
    basis = "body and step on an x86 core"
    if scenario.window is not None:
        basis = f"particle and step on this machine, as it is now, and per {basis}"
    if scenario.tanks:
        basis = "particle and step on two x86 cores; splashing takes longer"
    console.print(f"The estimate uses the cost per {basis}.", style="dim")


def _duration(seconds: float) -> str:
    """Write a time with two figures."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    minutes = seconds / 60.0
    return f"{minutes:.0f} min" if minutes < 90.0 else f"{minutes / 60.0:.1f} h"
