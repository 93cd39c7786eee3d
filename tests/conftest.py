"""Terms of every test: linear algebra on one thread, as the `oilsim` command has it, because its rounding depends on their number."""

from __future__ import annotations

import os
import sys

assert "numpy" not in sys.modules, "numpy was loaded before it could be told to use one thread"
for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")
