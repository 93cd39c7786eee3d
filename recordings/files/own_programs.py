"""Programs of our own that run beside this one: found where this one was found, and never in the folder that happens to be current.

`python -m` puts the current folder first on the path of modules, so that a `numpy.py` there, from an archive that somebody unpacked, would
be run. `-P` leaves it out.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable


def module_command(module: str, *arguments: str) -> list[str]:
    """Make the command that runs a module as a program; the current folder is not on its path."""
    return [sys.executable, "-P", "-m", module, *arguments]


def module_environment(search: Iterable[str] | None = None) -> dict[str, str]:
    """Copy the environment, with ``search`` as the places of modules: by default those of this program, in that order.

    An empty entry would be the current folder, whichever it is, and is left out.
    """
    places = sys.path if search is None else search
    return os.environ | {"PYTHONPATH": os.pathsep.join(place for place in places if place)}
