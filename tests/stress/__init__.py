"""Scenes nobody thought of: random liquids, bodies, booms and weather, run and held to what physics allows. `make stress`."""

import os

for library in ("OPENBLAS", "OMP", "MKL"):
    # before numpy comes in, as in tests.validation: its threads would take the cores from the fluid
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")
