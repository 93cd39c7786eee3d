"""Compiled kernels are taken from the cache as long as nothing that they were compiled from has changed, and in every checkout."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from numba import config

from oilsim.backend.jit import PACKAGES, module_of, source_stamp

pytestmark = pytest.mark.skipif(bool(config.DISABLE_JIT), reason="nothing is compiled")
REPOSITORY = Path(__file__).parents[3]
CALLED = "from numba import njit\nfrom vessels.numbers import ADDEND\n\n@njit\ndef plus(x):\n    return x + ADDEND\n"
CALLER = """from oilsim.backend import jit
from numba import njit
from vessels import other
from vessels.called import (
    plus,  # a comment
)

@njit(cache=True)
def twice(x):
    return 2 * plus(x)
"""
RUN = "from vessels.caller import twice\nprint(twice(1), *twice.stats.cache_hits.values(), sep=' ')"


def checkout(folder: Path) -> Path:
    """A package with a kernel that calls another one, which reads a constant of a third module."""
    package = folder / "vessels"
    package.mkdir(parents=True)
    texts = {"__init__": "", "numbers": "ADDEND = 3\n", "other": "", "unread": "", "called": CALLED, "caller": CALLER}
    for name, text in texts.items():
        (package / f"{name}.py").write_text(text)
    return package


def ran(package: Path, cache: Path) -> str:
    """Result of the kernel in a process of its own, and how often it came from the cache."""
    environment = os.environ | {
        "NUMBA_CACHE_DIR": str(cache),
        "PYTHONPATH": os.pathsep.join([str(package.parent), str(REPOSITORY)]),
    }
    done = subprocess.run(
        [sys.executable, "-c", RUN], env=environment, cwd=package.parent, capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


def test_kernel_is_compiled_anew_when_what_it_calls_reads_has_changed(tmp_path: Path) -> None:
    package, other = checkout(tmp_path / "one"), checkout(tmp_path / "two")
    assert ran(package, tmp_path / "cache") == "8"
    assert ran(other, tmp_path / "cache") == "8 1", "a clone of the same source"
    (package / "numbers.py").write_text("ADDEND = 4\n")
    assert ran(package, tmp_path / "cache") == "10"


def test_stamp_follows_the_modules_that_are_imported_and_no_others(tmp_path: Path) -> None:
    package = checkout(tmp_path)
    stamps = [source_stamp(package / "caller.py")]
    for name in ("unread", "other", "numbers", "called", "caller"):
        changed = checkout(tmp_path / name)
        (changed / f"{name}.py").write_text((changed / f"{name}.py").read_text() + "# changed\n")
        stamps.append(source_stamp(changed / "caller.py"))
    assert stamps[0] == stamps[1]
    assert len(set(stamps)) == 5


def test_files_of_others_are_left_to_numba(tmp_path: Path) -> None:
    (tmp_path / "kernels.py").write_text("")
    assert module_of(tmp_path / "kernels.py") is None
    found = module_of(REPOSITORY / "oilsim" / "backend" / "jit.py")
    assert found == (REPOSITORY, "oilsim.backend.jit")


def test_every_module_with_kernels_has_them_kept_by_their_sources() -> None:
    """numba's own places, which do not see what a kernel calls, are taken until `oilsim.backend.jit` is imported."""
    files = (file for package in PACKAGES for file in (REPOSITORY / package).rglob("*.py") if file.stem != "jit")
    texts = {file: file.read_text() for file in files}
    with_kernels = [file for file, text in texts.items() if re.search(r"^@njit", text, re.MULTILINE)]
    assert len(with_kernels) > 40
    assert [file for file in with_kernels if "from oilsim.backend.jit import" not in texts[file]] == []
