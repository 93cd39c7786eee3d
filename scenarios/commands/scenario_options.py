"""The arguments by which a subcommand is told which scenario to take, and how to change it."""

from __future__ import annotations

import argparse


def add_scenario(parser: argparse.ArgumentParser, *, required: bool = True) -> None:
    """Add the scenario's name and the options that change it."""
    text = "a shipped scenario's name, or a .toml file"
    parser.add_argument("scenario", metavar="NAME-or-FILE", nargs=None if required else "?", help=text)
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change an entry, as in fluid.particle_spacing=0.06 or phases.oil.dynamic_viscosity=0.1; may be repeated",
    )
    parser.add_argument("--demo", action="store_true", help="shorten the scenario by its [demo] table first")
    parser.add_argument("--threads", type=int, metavar="N", help="threads of the fluid; all cores by default")
    parser.add_argument("--until", type=float, metavar="S", help="simulated seconds, instead of the scenario's")


def overrides(options: argparse.Namespace) -> tuple[str, ...]:
    """The --set texts and those that --threads and --until stand for."""
    extra = []
    if options.threads is not None:
        extra.append(f"run.threads={options.threads}")
    if options.until is not None:
        extra.append(f"run.duration={options.until!r}")
    return (*options.set, *extra)
