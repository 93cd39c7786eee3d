"""The run of a console, in a process of its own, so that pages answer whatever the run does."""

from __future__ import annotations

import os
import signal
import sys
import threading
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path

from rich.console import Console

from recordings.files.writing import RecordingError
from scenarios.conduct.console_feed import LatestSender
from scenarios.text.problems import ScenarioError

FLUSH = 5.0  # [s] for the last messages to a console


@dataclass(frozen=True, kw_only=True)
class Errand:
    """A run to make: a scenario from its start, or a recorded run from a moment on.

    scenario: name or file, with the changes `overrides`, shortened if `demo`; source: the recording to continue at `at` [s] instead, with
    the orders `settings` there; record: the recording to write; pace: simulated seconds a second; paused: whether it begins paused; viewer:
    address of the viewer that shows it too, empty without one.
    """

    scenario: str
    record: Path
    overrides: tuple[str, ...] = ()
    demo: bool = False
    source: Path | None = None
    at: float = 0.0
    settings: tuple[str, ...] = ()
    pace: float = 1.0
    paused: bool = True
    viewer: str = ""


def start_run(errand: Errand) -> tuple[BaseProcess, Connection]:
    """Start a run; return its process, and the pipe from which to read what it shows."""
    context = get_context("spawn")
    reader, writer = context.Pipe(duplex=False)
    process = context.Process(target=make_run, args=(errand, writer), name=f"oilsim {errand.scenario}")
    process.start()
    writer.close()
    return process, reader


def make_run(errand: Errand, pipe: Connection) -> None:
    """Make the run, to its end; ends the process with its exit code."""
    sender = LatestSender(pipe)
    threading.Thread(target=_end_with_console, name="console's end", daemon=True).start()
    code = 1
    try:
        code = _run(errand, sender)
    except (ScenarioError, RecordingError) as error:
        sender.send({"kind": "failed", "text": str(error)})
    except BaseException as error:
        sender.send({"kind": "failed", "text": f"{type(error).__name__}: {error}"})
        raise
    finally:
        sender.close(FLUSH)
    sys.exit(code)


def _end_with_console() -> None:
    """Stop the run in order when the console's process ends, however it ends."""
    console = parent_process()
    if console is not None:
        console.join()
        os.kill(os.getpid(), signal.SIGTERM)


def _run(errand: Errand, sender: LatestSender) -> int:
    """Run the errand; return the exit code."""
    from recordings.sink.live import LiveView
    from scenarios.conduct.console_feed import ConsoleFeed
    from scenarios.running.assembly import Assembly
    from scenarios.running.checkpoints import find_restart
    from scenarios.running.pace import Pace
    from scenarios.running.plan import Plan
    from scenarios.running.run import RunOptions, resume, run_scenario
    from scenarios.spec.load import load_scenario

    pace, quiet = Pace(errand.pace), Console(quiet=True)

    def options(plan: Plan, source: Path | None) -> RunOptions:
        def feed(assembly: Assembly) -> ConsoleFeed:
            return ConsoleFeed(assembly, plan, pace, sender, paused=errand.paused)

        return RunOptions(
            record=errand.record,
            summary=errand.record.with_suffix(".json"),
            source=source,
            live=LiveView(errand.viewer, is_embedded=True) if errand.viewer else False,
            takes_orders=True,
            pace=pace,
            begins_paused=errand.paused,
            watchers=(feed,),
        )

    if errand.source is not None:
        restart = find_restart(errand.source, errand.at).with_settings(errand.settings, errand.at)
        return resume(restart, options=options(restart.plan, None), console=quiet)
    loaded = load_scenario(errand.scenario, overrides=errand.overrides, demo=errand.demo)
    return run_scenario(
        loaded.scenario,
        text=loaded.text,
        overrides=errand.overrides,
        options=options(Plan(scenario=loaded.scenario), loaded.path),
        console=quiet,
    )
