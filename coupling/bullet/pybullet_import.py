"""Imports pybullet without the build time that it prints to standard error; all other modules import pybullet from here."""

from __future__ import annotations

import os
import sys

sys.stderr.flush()
_kept, _nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
os.dup2(_nowhere, 2)
try:
    import pybullet
finally:
    os.dup2(_kept, 2)
    os.close(_kept)
    os.close(_nowhere)

__all__ = ["pybullet"]
