"""`oilsim sweep`: run a scenario once for every combination of some entries' values."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from scenarios.commands.options import add_scenario, overrides


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser(
        "sweep", help="run a scenario once for every combination of values, and compare the runs"
    )
    add_scenario(parser, seeded=False)
    parser.add_argument(
        "--vary",
        action="append",
        default=[],
        metavar="KEY=VALUE,VALUE,...",
        help="values for an entry, for example tow.speed_kn=0.3,0.5,0.7; may be repeated",
    )
    parser.add_argument(
        "--range",
        action="append",
        default=[],
        metavar="KEY=LOW:HIGH",
        help="sample an entry between two numbers, for example tow.speed_kn=0.3:0.9; may be repeated; needs --runs",
    )
    parser.add_argument("--runs", type=int, metavar="N", help="number of samples of the ranges")
    parser.add_argument(
        "--method",
        choices=("latin-hypercube", "monte-carlo"),
        default="latin-hypercube",
        help="how the ranges are sampled (default: latin-hypercube)",
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the samples (default: 0)")
    parser.add_argument(
        "--workers",
        type=int,
        metavar="N",
        help="runs at a time on this machine, one thread each (default: a run for each core); 1: one after the other, on all cores",
    )
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="make the runs on the Dask cluster with this scheduler, for example tcp://host:8786 (needs oilsim[cluster])",
    )
    parser.add_argument(
        "--to",
        type=Path,
        metavar="FOLDER",
        help="folder for the results (default: NAME-sweep); complete runs in it are not repeated",
    )
    parser.add_argument("--record", action="store_true", help="record each run, too")
    parser.set_defaults(command=_sweep, seeds_run=False)


def _sweep(options: argparse.Namespace) -> int:
    from scenarios.sweeps.sweep import run_sweep
    from scenarios.sweeps.variants import parse_variation, require_few, variants

    _require(options)
    variations = [parse_variation(text) for text in options.vary]
    require_few([len(one.values) for one in variations], options.runs or 1)
    chosen = variants(
        options.scenario, variations, overrides=overrides(options), demo=options.demo, samples=_samples(options)
    )
    folder = options.to or Path(f"{chosen[0].plan.scenario.name}-sweep")
    workers = options.workers or len(os.sched_getaffinity(0))
    return run_sweep(chosen, folder, recorded=options.record, workers=workers, scheduler=options.scheduler)


def _require(options: argparse.Namespace) -> None:
    """Raise ScenarioError for options that do not go together."""
    from scenarios.text.problems import Problem, ScenarioError

    found = []
    if not options.vary and not options.range:
        found.append(Problem("--vary", "is missing, allowed: --vary KEY=VALUE,... or --range KEY=LOW:HIGH"))
    if options.range and options.runs is None:
        found.append(Problem("--runs", "is missing, allowed: 1 or more, with --range"))
    if options.range and options.runs is not None and options.runs < 1:
        found.append(Problem("--runs", f"is {options.runs}, allowed: 1 or more, with --range"))
    if options.runs is not None and not options.range:
        found.append(Problem("--runs", f"is {options.runs}, allowed: only with --range"))
    if options.seed < 0:
        found.append(Problem("--seed", f"is {options.seed}, allowed: 0 or more"))
    if options.workers is not None and options.workers < 1:
        found.append(Problem("--workers", f"is {options.workers}, allowed: 1 or more"))
    if options.scheduler and options.workers is not None:
        found.append(Problem("--workers", "is given, allowed: without --scheduler, whose workers make the runs"))
    if options.scheduler and options.record:
        found.append(Problem("--record", "is given, allowed: without --scheduler; a cluster's runs leave summaries"))
    if found:
        raise ScenarioError(found, "oilsim")


def _samples(options: argparse.Namespace) -> list[dict[str, str]]:
    """Draw the samples of the ranges; one empty sample without ranges."""
    from scenarios.sweeps.variants import parse_range, samples
    from scenarios.text.problems import Problem, ScenarioError

    ranges = [parse_range(text) for text in options.range]
    keys = [one.key for one in ranges]
    twice = sorted({key for key in keys if keys.count(key) > 1})
    if twice:
        raise ScenarioError([Problem(f"--range {key}", "is given twice, allowed: once") for key in twice], "oilsim")
    return samples(ranges, options.runs, options.method, options.seed) if ranges else [{}]
