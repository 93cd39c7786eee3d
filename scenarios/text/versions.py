"""The versions of the software that made a run."""

from __future__ import annotations

import platform
from importlib import metadata

PACKAGES = ("oilsim", "numpy", "numba", "pybullet", "trimesh", "rerun-sdk")


def versions() -> dict[str, str]:
    """List the versions of Python and of the packages that a run depends on, by name."""
    return {"python": platform.python_version()} | {name: metadata.version(name) for name in PACKAGES}
