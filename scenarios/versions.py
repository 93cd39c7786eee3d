"""The versions a run was made with."""

from __future__ import annotations

import platform
from importlib import metadata

PACKAGES = ("oilsim", "numpy", "numba", "pybullet", "trimesh", "rerun-sdk")


def versions() -> dict[str, str]:
    """Versions of Python and of what a run depends on, by name."""
    return {"python": platform.python_version()} | {name: metadata.version(name) for name in PACKAGES}
