"""The public names of the package: all are there, and describing a fluid compiles nothing."""

from __future__ import annotations

import subprocess
import sys

import pytest

import oilsim


@pytest.mark.parametrize("name", oilsim.__all__)
def test_public_names_exist(name):
    assert getattr(oilsim, name).__name__ == name


def test_another_name_is_refused():
    with pytest.raises(AttributeError, match=r"no attribute 'Solver', allowed: AdvanceReport, "):
        oilsim.Solver  # noqa: B018


def test_a_fluid_is_described_without_compiled_code():
    program = "import sys; from oilsim import FluidConfig, Phase, PipeEmitter, block; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
