"""The versions of the software that made a run."""

from __future__ import annotations

import platform
from functools import cache
from importlib import metadata

_version = cache(metadata.version)  # which looks into files, and every summary has the versions
PACKAGES = ("oilsim", "numpy", "numba", "pybullet", "trimesh", "rerun-sdk")


def versions() -> dict[str, str]:
    """List the versions of Python and of the packages that a run depends on, by name."""
    return {"python": platform.python_version()} | {name: _version(name) for name in PACKAGES}
