"""The `oilsim` command: list, check, run and sweep scenarios, give orders to runs, and replay, compare, verify and export recordings.

Exit codes: 0 done; 1 a run failed (its recording up to then is kept) or a difference was found; 2 bad input (the message says what,
where, and what is allowed).
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Iterator, MutableSequence, Sequence
from contextlib import contextmanager

from recordings.files.writing import RecordingError
from scenarios.commands import catalogs, check, conduct, export, fmu, order, playback, run, shipped, sweep
from scenarios.text.problems import BAD_INPUT, DONE, INTERRUPTED, ScenarioError

REGISTER = (
    shipped.register_list, shipped.register_new, catalogs.register_oils, catalogs.register_equipment, check.register, run.register,
    conduct.register, order.register, sweep.register, playback.register_replay, playback.register_debrief, playback.register_compare,
    playback.register_verify, playback.register_report, export.register, playback.register_repair, fmu.register_signals,
    fmu.register_build, fmu.register_export,
)  # fmt: skip


EXTRAS = {
    "distributed": ("sweeps on a Dask cluster", "cluster"),
    "fmpy": ("FMUs", "fmu"),
    "starlette": ("the console of `oilsim conduct`", "conduct"),
    "uvicorn": ("the console of `oilsim conduct`", "conduct"),
    "shapely": ("outlines of slicks", "export"),
    "vtkmodules": ("films for ParaView", "export"),
}  # packages that oilsim runs without, for what they are needed, and the extra that installs them


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    with _children_of_installed_code():
        return _run(arguments)


@contextmanager
def _children_of_installed_code() -> Iterator[None]:
    """Let no program that this one starts run a module of the folder that is current."""
    before = os.environ.get("PYTHONSAFEPATH")
    os.environ["PYTHONSAFEPATH"] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ["PYTHONSAFEPATH"]
        else:
            os.environ["PYTHONSAFEPATH"] = before


def _run(arguments: Sequence[str] | None) -> int:
    """Run the command; return its exit code."""
    for library in ("OPENBLAS", "OMP", "MKL"):
        # The matrices here are small; threads of a linear algebra library would only take cores from the fluid.
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    given = _with_negative_values(sys.argv[1:] if arguments is None else arguments)
    parser = command_parser()
    options = parser.parse_args(given)
    try:
        _tell_twice(parser, given)
        code = int(options.command(options))
        sys.stdout.flush()
        return code
    except BrokenPipeError:  # the reader, such as `head`, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except ScenarioError as error:
        print(error, file=sys.stderr)
        return BAD_INPUT
    except RecordingError as error:
        print(f"oilsim: {error}", file=sys.stderr)
        return BAD_INPUT
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in EXTRAS:
            raise
        what, extra = EXTRAS[package]
        print(f"oilsim: {package} is not installed, needed for {what}: pip install 'oilsim[{extra}]'", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        return INTERRUPTED


def _tell_twice(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    """Tell of an option that takes one value and is given twice; argparse keeps the last without a word."""
    of_commands = next(action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    parser_of = of_commands.choices[next(argument for argument in arguments if argument in of_commands.choices)]
    options = {word: action for action in parser_of._actions for word in action.option_strings}
    written = [argument.partition("=")[0] for argument in arguments if argument.startswith("--") and argument != "--"]
    meant = [
        word if word in options else next((name for name in options if name.startswith(word)), "") for word in written
    ]
    twice = sorted(
        {name for name in meant if meant.count(name) > 1 and isinstance(options.get(name), argparse._StoreAction)}
    )
    for name in twice:
        print(f"oilsim: {name} is given twice, the last counts", file=sys.stderr)


def _with_negative_values(arguments: Sequence[str]) -> Sequence[str]:
    """Tie values such as -36.9,174.8 to their option, since argparse takes them for options of their own."""
    tied: MutableSequence[str] = []
    for argument in arguments:
        if tied and re.match(r"-[\d.]", argument) and re.fullmatch(r"--[a-z][a-z-]*", tied[-1]):
            tied[-1] += f"={argument}"
        else:
            tied.append(argument)
    return tied


def command_parser() -> argparse.ArgumentParser:
    """Make the parser of the command, with one subparser for each subcommand."""
    parser = argparse.ArgumentParser(
        prog="oilsim",
        description="Simulate oil and sea water around rocks, booms and vessels: run scenario files, replay and evaluate the recordings.",
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for register in REGISTER:
        register(commands)
    return parser


if __name__ == "__main__":
    sys.exit(main())
