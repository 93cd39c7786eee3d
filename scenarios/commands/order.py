"""`oilsim order`: change a run that goes on, pause it, or let it go on."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from scenarios.text.problems import DONE, FAILED, Problem, ScenarioError

if TYPE_CHECKING:
    from scenarios.orders.client import Answer

PAUSE, GO_ON = "pause", "go-on"


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser(
        "order", help="change a run that goes on, from another terminal; pause it, or let it go on"
    )
    parser.add_argument("run", metavar="RUN", help="the run's recording (.rrd), or its name if no other run has it")
    parser.add_argument(
        "words",
        nargs="+",
        metavar="KEY=VALUE",
        help="entries to change at the run's next communication point, all or none, for example tow.speed_kn=0.5; before them the word "
        "pause lets the run wait at that point, and after them the word go-on lets it go on",
    )
    parser.add_argument(
        "--patience", type=float, default=60.0, metavar="S", help="time [s] to wait for the answer (default: 60)"
    )
    parser.set_defaults(command=_order)


def _order(options: argparse.Namespace) -> int:
    from scenarios.orders.client import NoAnswerError, go_on, order, pause

    words = list(options.words)
    pauses = words[0] == PAUSE
    settings = words[1:] if pauses else words
    goes_on = settings[-1:] == [GO_ON]
    settings = settings[:-1] if goes_on else settings
    if {PAUSE, GO_ON} & set(settings):
        text = f"is {' '.join(words)!r}, allowed: {PAUSE} as the first word, and {GO_ON} as the last"
        raise ScenarioError([Problem("the order", text)], "oilsim")
    if not 0.0 < options.patience < 1e6:
        raise ScenarioError([Problem("--patience", f"is {options.patience} s, allowed: above 0 s")], "oilsim")
    try:
        if pauses:
            _say(pause(options.run, patience=options.patience))
        if settings:
            _say(order(options.run, *settings, patience=options.patience))
        if goes_on:
            _say(go_on(options.run, patience=options.patience))
    except NoAnswerError as error:
        print(f"oilsim: {error}", file=sys.stderr)
        return FAILED
    return DONE


def _say(answer: Answer) -> None:
    print(f"{answer.time:.2f} s  {answer.text}")
