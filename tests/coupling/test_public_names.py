"""The public names of the package: each is there, and a program without pybullet may import the package."""

from __future__ import annotations

import subprocess
import sys

import pytest

import coupling


def test_each_public_name_is_there() -> None:
    for name in coupling.__all__:
        assert getattr(coupling, name).__module__.startswith("coupling."), name
    assert sorted(coupling.__all__) == sorted(name for names in coupling._HOMES.values() for name in names.split())
    with pytest.raises(AttributeError, match=r"has no attribute 'attach', allowed: .*attach_fluid"):
        _ = coupling.attach  # type: ignore[attr-defined]


def test_the_package_alone_loads_neither_pybullet_nor_fmpy() -> None:
    code = (
        "import sys, coupling; coupling.Participant; print(sorted({'pybullet', 'fmpy', 'trimesh'} & set(sys.modules)))"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert told.strip() == "[]"
