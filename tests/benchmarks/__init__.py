"""Measured speed: scripts that print tables, not tests."""

import os

for library in ("OPENBLAS", "OMP", "MKL"):
    # Before numpy comes in: a linear algebra library that spins threads of its own takes the cores from the fluid.
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")
