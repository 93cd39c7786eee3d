"""Terms of every test: linear algebra on one thread, as the `oilsim` command has it, because its rounding depends on their number.

What is imported to collect the tests stays; the garbage collector need not look through it again and again.
"""

from __future__ import annotations

import gc
import os
import sys
from importlib.metadata import entry_points

for name in (f"{library}_NUM_THREADS" for library in ("OPENBLAS", "OMP", "MKL")):
    told = os.environ.setdefault(name, "1") if "numpy" not in sys.modules else os.environ.get(name)
    assert told is not None, f"a plugin of pytest loads numpy before it could be told to use one thread: set {name}=1"

if not any(entry.name == "oilsim" for entry in entry_points(group="pytest11")):
    pytest_plugins = ["scenarios.bench.plugin"]  # from a source tree that is not installed


def pytest_collection_finish() -> None:
    """Take what is there now from the garbage collector: a twentieth of the suite's work."""
    gc.freeze()
