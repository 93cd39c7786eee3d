"""The command-line arguments that choose a scenario and change it."""

from __future__ import annotations

import argparse


def add_scenario(parser: argparse.ArgumentParser, *, required: bool = True, seeded: bool = True) -> None:
    """Add the scenario's name, and the options that change it, to a parser; `seeded`: --seed is among them."""
    text = "name of a shipped scenario, or a .toml file"
    parser.add_argument("scenario", metavar="NAME-or-FILE", nargs=None if required else "?", help=text)
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change an entry, for example fluid.particle_spacing=0.06 or phases.oil.dynamic_viscosity=0.1; may be repeated",
    )
    parser.add_argument("--demo", action="store_true", help="shorten the run as the scenario's [demo] table says")
    parser.add_argument(
        "--level", choices=("easy", "normal", "hard"), help="variant of an exercise that has an easy and a hard one"
    )
    if seeded:
        parser.add_argument(
            "--seed", type=int, metavar="N", help="of everything random: gusts, waves, and when injects come (run.seed)"
        )
    parser.add_argument("--threads", type=int, metavar="N", help="number of threads (default: all cores)")
    parser.add_argument(
        "--until", type=float, metavar="S", help="simulated time [s] at which the run ends (default: the scenario's)"
    )


def overrides(options: argparse.Namespace) -> tuple[str, ...]:
    """Collect the texts of --set, and the entries that --threads, --until, --level and --seed change."""
    extra = []
    if options.threads is not None:
        extra.append(f"run.threads={options.threads}")
    if options.until is not None:
        extra.append(f"run.duration={options.until!r}")
    if getattr(options, "level", None) is not None:
        extra.append(f"level={options.level}")
    if getattr(options, "seeds_run", True) and getattr(options, "seed", None) is not None:
        extra.append(f"run.seed={options.seed}")
    return (*options.set, *extra)
