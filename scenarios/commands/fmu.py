"""`oilsim build-fmu | export-fmu | signals`: models and exercises as FMUs, and the signals that connect them."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import Literal

from scenarios.commands.options import add_scenario, overrides
from scenarios.running.output_paths import require_apart, require_writable
from scenarios.text.problems import DONE, Problem, ScenarioError

STEP_SIZE, STOP_TIME = 0.02, 10.0  # [s], the default experiment of the FMU


def register_build(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser("build-fmu", help="build an FMU from a model, a Python class")
    parser.add_argument(
        "model",
        metavar="MODEL",
        help="Python file that defines a coupling.fmu.scalar_model.ScalarModel",
    )
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="FMU to write (default: MODEL.fmu)")
    add_version(parser)
    parser.set_defaults(command=_build)


def add_version(parser: argparse.ArgumentParser) -> None:
    """Add the option --fmi to a parser."""
    parser.add_argument("--fmi", type=int, choices=(2, 3), default=3, help="version of FMI (default: 3)")


def _build(options: argparse.Namespace) -> int:
    output = options.output or Path(f"{Path(options.model).stem}.fmu")
    print(f"{output}: {build_fmu(options.model, output, options.fmi)}, FMI {options.fmi}")
    return DONE


def build_fmu(model_name: str, output: Path, version: Literal[2, 3]) -> str:
    """Build an FMU from the source of a model, and return the model's name; ScenarioError if it cannot be built."""
    from coupling.fmu.export import FmuContent, FmuExportError, export_fmu
    from coupling.fmu.scalar_model import MODEL_FILE, model_in

    source = _source(model_name)
    require_writable({"--output": output})
    require_apart({"the model": source}, {"--output": output})
    try:
        model = model_in(source)
        model.save_state()  # fails here if the model cannot save its state, as its FMU promises
        said = (type(model).__doc__ or "").strip() or model.name
        content = FmuContent(
            identifier=model.name,
            factory="coupling.fmu.scalar_model:model_in_folder",
            description=said.splitlines()[0],
            step_size=STEP_SIZE,
            stop_time=STOP_TIME,
            any_step=True,
            files={MODEL_FILE: source},
        )
        export_fmu(content, output, version)
    except (FmuExportError, NotImplementedError, ValueError) as error:
        raise ScenarioError([Problem(model_name, f"cannot be built as an FMU: {error}")], "oilsim") from error
    return model.name


def _source(model: str) -> Path:
    """Return the file of a model; ScenarioError if there is none."""
    path = Path(model)
    if re.search(r"\.py$", model) and path.is_file():
        return path
    raise ScenarioError([Problem(f"model {model!r}", "is no Python file, allowed: a .py file")], "oilsim")


def register_export(commands: argparse._SubParsersAction) -> None:
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
    from scenarios.running.exercise_fmu import exercise_content, exercise_signals
    from scenarios.running.plan import Plan
    from scenarios.spec.load import load_scenario

    loaded = load_scenario(options.scenario, overrides=overrides(options), demo=options.demo)
    output = options.output or Path(f"{loaded.scenario.name}.fmu")
    require_writable({"--output": output})
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


def register_signals(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser("signals", help="list the signals of a scenario: its inputs and outputs for FMUs")
    add_scenario(parser)
    parser.set_defaults(command=_signals)


def _signals(options: argparse.Namespace) -> int:
    from rich.table import Table

    from scenarios.controls.signals import signals_of
    from scenarios.spec.load import load_scenario
    from scenarios.text.terminal import terminal

    scenario = load_scenario(options.scenario, overrides=overrides(options), demo=options.demo).scenario
    table = Table("signal", "unit", "direction")
    for signal in signals_of(scenario.parts).values():
        table.add_row(
            signal.name, signal.unit, f"input, {signal.start:g} at the start" if signal.is_input else "output"
        )
    terminal().print(table)
    return DONE
