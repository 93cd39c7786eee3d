"""One run of a sweep in a process of its own: `python -m scenarios.sweeps.remote_run PLAN.json SUMMARY.json [RECORDING.rrd]`.

A crash of the run cannot take a worker of a cluster with it, and a run may have the signals that it needs. The process ends when the one
that started it is gone.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from recordings.files.writing import module_command, module_environment

WATCH_INTERVAL = 1.0  # [s] between looks after the parent; technical
TOLD = 2000  # characters of a failed run's last words


def run_elsewhere(
    plan: Mapping[str, Any], record: str | None = None, started: Callable[[subprocess.Popen[str]], None] | None = None
) -> dict[str, Any]:
    """Run a plan (`Plan.as_data`) in a new process; return `code`, `summary` (None without one) and `said`, its last words.

    record: path of the recording to write, None for none; started: is handed the process, which has a session of its own: Ctrl-C in a
    terminal does not reach it.
    """
    with tempfile.TemporaryDirectory(prefix="oilsim-") as folder:
        order, summary = Path(folder, "plan.json"), Path(folder, "summary.json")
        order.write_text(json.dumps(plan), encoding="utf-8")
        places = [str(order), str(summary), *([record] if record else [])]
        command = module_command("scenarios.sweeps.remote_run", *places)
        process = subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=module_environment(),
            start_new_session=True,
        )
        if started is not None:
            started(process)
        out, error = process.communicate()
        written = json.loads(summary.read_text(encoding="utf-8")) if summary.is_file() else None
    return {"code": process.returncode, "summary": written, "said": (error or out)[-TOLD:]}


def _run(order: Path, summary: Path, record: Path | None) -> int:
    from rich.console import Console

    from scenarios.running.plan import plan_from
    from scenarios.running.run import RunOptions, run_scenario

    plan = plan_from(json.loads(order.read_text(encoding="utf-8")))
    options = RunOptions(record=record, summary=summary, overwrite=True)
    return run_scenario(
        plan.scenario, text=plan.text, overrides=plan.overrides, options=options, console=Console(stderr=True)
    )


def _end_with(parent: int) -> None:
    """End this process once it has another parent, because its own is gone."""
    while os.getppid() == parent:
        time.sleep(WATCH_INTERVAL)
    os._exit(1)


if __name__ == "__main__":
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    places = [Path(one) for one in sys.argv[1:]]
    sys.exit(_run(places[0], places[1], places[2] if len(places) > 2 else None))
