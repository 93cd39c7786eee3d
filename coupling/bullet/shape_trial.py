"""Finds out whether pybullet can tell a body's collision shapes, before the process is trusted to a call that may end it.

`getCollisionShapeData` of pybullet 3.2.7 reads memory that is not there for shapes of several spheres, as `loadMJCF` makes them of
capsules with `fromto`. Where the engine runs in this process it is asked in a copy of the process first. A copy may live by
chance, and where the engine runs elsewhere it could not ask. So the engine's own file tells besides whether its world has such
shapes.
"""

from __future__ import annotations

import faulthandler
import os
import resource
import signal
import tempfile
import time
import warnings
from pathlib import Path

from coupling.bullet.engine_state import kinds_of_shapes
from coupling.bullet.pybullet_import import pybullet

_PATIENCE = 10.0  # s, far above what the longest answer takes
_OWN = {getattr(pybullet, name) for name in ("DIRECT", "SHARED_MEMORY_SERVER") if hasattr(pybullet, name)}
_SPHERES = "btMultiSphereShapeData"
_OTHERWISE = "a URDF file of it, or capsules in its MJCF file by size, pos and quat in place of fromto"


def require_askable(client: int, body: int) -> None:
    """Require that pybullet can tell the collision shapes of a body, given by its unique id, in the world of a client, given by its id.

    Raises ValueError if the question ends the process or is not answered; for an engine in another process, if it may end this one.
    """
    is_own = pybullet.getConnectionInfo(client)["connectionMethod"] in _OWN
    trouble = _trouble_in_copy(client, body) if is_own else ""
    if not trouble and _may_have_spheres(client, body) and _SPHERES in _world_kinds(client):
        trouble = "may end the process"  # a copy that lived read what happened to lie there
    if trouble:
        raise ValueError(
            f"body {body}: pybullet's getCollisionShapeData {trouble} where a shape is made of spheres, as capsules of MJCF files by "
            f"fromto are, allowed: {_OTHERWISE}"
        )


def _trouble_in_copy(client: int, body: int) -> str:
    """How a copy of this process fared that asked for all shapes; empty if well."""
    with warnings.catch_warnings():
        # Python 3.12 warns of copies beside threads; this one asks pybullet only, waits for no thread, and has a limit of time
        warnings.filterwarnings("ignore", message=".*fork", category=DeprecationWarning)
        child = os.fork()
        if child == 0:
            _ask_and_leave(client, body)
    deadline = time.monotonic() + _PATIENCE
    while time.monotonic() < deadline:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return "" if os.WIFEXITED(status) else f"ends the process ({signal.Signals(os.WTERMSIG(status)).name})"
        time.sleep(0.001)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return "does not come back"


def _ask_and_leave(client: int, body: int) -> None:
    """Run by the copy: it says nothing, leaves no core file, and ends without Python's own end."""
    try:
        faulthandler.disable()
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        quiet = os.open(os.devnull, os.O_WRONLY)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
        for link in range(-1, pybullet.getNumJoints(body, physicsClientId=client)):
            for index, shape in enumerate(pybullet.getCollisionShapeData(body, link, physicsClientId=client)):
                if shape[2] == pybullet.GEOM_MESH:
                    pybullet.getMeshData(body, link, collisionShapeIndex=index, physicsClientId=client)
    finally:
        os._exit(0)  # what is wrong without ending the process is told when the process itself asks


def _world_kinds(client: int) -> set[str]:
    """The kinds of all collision shapes of the client's world."""
    with tempfile.TemporaryDirectory(prefix="oilsim-") as folder:
        path = Path(folder) / "world.bullet"
        pybullet.saveBullet(str(path), physicsClientId=client)
        return kinds_of_shapes(path.read_bytes()) if path.is_file() else set()


def _may_have_spheres(client: int, body: int) -> bool:
    """Whether the body shows a capsule, or does not show what it is."""
    shown = [shape[2] for shape in pybullet.getVisualShapeData(body, physicsClientId=client)]
    return not shown or pybullet.GEOM_CAPSULE in shown
