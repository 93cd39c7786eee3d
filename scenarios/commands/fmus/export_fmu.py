"""`oilsim export-fmu`: write a whole exercise as an FMU."""

from __future__ import annotations

import argparse
from pathlib import Path

from scenarios.commands.fmus.build_fmu import add_version, require_folder
from scenarios.commands.options.scenario import add_scenario, overrides
from scenarios.exit_codes import DONE
from scenarios.problems import Problem, ScenarioError
from scenarios.running.output_paths import require_apart


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser(
        "export-fmu", help="write a whole exercise as an FMU that other co-simulation programs can run"
    )
    add_scenario(parser)
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="FMU to write (default: NAME.fmu)")
    add_version(parser)
    parser.set_defaults(command=_export)


def _export(options: argparse.Namespace) -> int:
    from coupling.fmu.export import FmuExportError, export_fmu
    from scenarios.load import load_scenario
    from scenarios.running.exercise_fmu import exercise_content, exercise_signals
    from scenarios.running.plan import Plan

    loaded = load_scenario(options.scenario, overrides=overrides(options), demo=options.demo)
    output = options.output or Path(f"{loaded.scenario.name}.fmu")
    require_folder(output, "--output")
    require_apart({"the scenario": loaded.path} | Plan(scenario=loaded.scenario).files, {"--output": output})
    try:
        export_fmu(exercise_content(loaded.scenario), output, options.fmi)
    except FmuExportError as error:
        raise ScenarioError(
            [Problem(loaded.scenario.name, f"cannot be exported as an FMU: {error}")], "oilsim"
        ) from error
    signals = exercise_signals(loaded.scenario).values()
    taken = [signal.name for signal in signals if signal.is_input]
    print(f"{output}: {loaded.scenario.name}, FMI {options.fmi}, {len(signals) - len(taken)} outputs")
    print(f"inputs: {', '.join(taken) or 'none'}")
    return DONE
