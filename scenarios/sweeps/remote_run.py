"""One run of a sweep in a process of its own: `python -m scenarios.sweeps.remote_run PLAN.json SUMMARY.json`.

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
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from recordings.own_programs import module_command, module_environment

WATCH_INTERVAL = 1.0  # [s] between looks after the parent; technical
TOLD = 2000  # characters of a failed run's last words


def run_elsewhere(plan: Mapping[str, Any]) -> dict[str, Any]:
    """Run a plan (`Plan.as_data`) in a new process; return `code`, `summary` (None without one) and `said`, its last words."""
    with tempfile.TemporaryDirectory(prefix="oilsim-") as folder:
        order, summary = Path(folder, "plan.json"), Path(folder, "summary.json")
        order.write_text(json.dumps(plan), encoding="utf-8")
        command = module_command("scenarios.sweeps.remote_run", str(order), str(summary))
        ended = subprocess.run(command, capture_output=True, text=True, check=False, env=module_environment())
        written = json.loads(summary.read_text(encoding="utf-8")) if summary.is_file() else None
    return {"code": ended.returncode, "summary": written, "said": (ended.stderr or ended.stdout)[-TOLD:]}


def _run(order: Path, summary: Path) -> int:
    from rich.console import Console

    from scenarios.running.plan import plan_from
    from scenarios.running.run import RunOptions, run_scenario

    plan = plan_from(json.loads(order.read_text(encoding="utf-8")))
    options = RunOptions(record=None, summary=summary, overwrite=True)
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
    sys.exit(_run(Path(sys.argv[1]), Path(sys.argv[2])))
