"""Read, compare and renew the table of recorded runs: `python -m tests.regression [NAME ...] [--update]`.

Bits depend on the processor (its vector registers) and on the versions of the compiler and of the libraries. The table names
those it was made with; on others, runs are compared by their sums, within what rounding makes of them.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

from llvmlite import binding

from tests.regression.runs import CASES

TABLE = Path(__file__).parent / "table.json"
LIBRARIES = ("numpy", "numba", "llvmlite", "scipy", "pybullet", "trimesh")
NEARLY = 0.02  # relative: ten to sixty steps of a splash, that differ by rounding, on another processor
ROUNDING = (
    1e-12  # relative, of the sums: a BLAS adds up in an order of its own, which the number of its threads changes
)
BITS = ("motion", "state")


def machine() -> dict[str, str]:
    """Name everything but the code on which the bits depend: processor, Python and libraries."""
    python = f"{sys.version_info.major}.{sys.version_info.minor}"
    return {"processor": binding.get_host_cpu_name(), "python": python} | {name: version(name) for name in LIBRARIES}


def recorded() -> dict[str, Any]:
    """The committed table: `machine`, and figures by run."""
    table: dict[str, Any] = json.loads(TABLE.read_text())
    return table


def differences(name: str, found: dict[str, Any], table: dict[str, Any]) -> list[str]:
    """Say how a run differs from the table; empty if it does not."""
    kept = table["runs"][name]
    same_machine = table["machine"] == machine()
    tolerance = ROUNDING if same_machine else NEARLY
    return [
        f"{name}: {key} is {found[key]!r}, on record {kept[key]!r}"
        for key in kept
        if (same_machine and found[key] != kept[key] if key in BITS else not _near(found[key], kept[key], tolerance))
    ]


def _near(found: Any, kept: Any, tolerance: float) -> bool:
    if isinstance(kept, list):
        return len(found) == len(kept) and all(
            _near(one, other, tolerance) for one, other in zip(found, kept, strict=True)
        )
    return math.isclose(found, kept, rel_tol=tolerance, abs_tol=tolerance)


def main(arguments: list[str]) -> int:
    """Run the named cases, or all; print what differs from the table, or write it anew with --update."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.regression", description="Compare runs bit by bit with the table."
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"runs; default all: {', '.join(CASES)}")
    parser.add_argument("--update", action="store_true", help="write the table anew")
    options = parser.parse_args(arguments)
    if unknown := sorted(set(options.names) - set(CASES)):
        parser.error(f"NAME is {', '.join(unknown)}, allowed: {', '.join(CASES)}")
    update, names = options.update, options.names or list(CASES)
    table = recorded() if TABLE.exists() else {"machine": machine(), "runs": {}}
    if update and table["machine"] != machine():
        names = list(CASES)  # bits of two machines are not to be mixed
    different = []
    for name in names:
        found = CASES[name]()
        if update:
            table["runs"][name] = found
        else:
            told = differences(name, found, table)
            print(f"{name}: {'as recorded' if not told else 'DIFFERENT'}", flush=True)
            different += told
    if update:
        table["machine"] = machine()
        TABLE.write_text(json.dumps(table, indent=1) + "\n")
    print("\n".join(different))
    return 1 if different else 0
