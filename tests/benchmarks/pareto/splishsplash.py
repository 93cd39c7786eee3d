"""SPlisHSPlasH (Bender et al., MIT licence) on a scene: DFSPH, implicit viscosity after Weiler et al. 2018.

    python -m tests.benchmarks.pareto.splishsplash JOB.json     what `run` starts, one process a run

Every run has a process of its own: the library keeps global state, and a run that goes wrong must not end the benchmark.

What makes the comparison fair, all measured on a still column:
- its y is up: (x, y, z) here is (x, z, -y) there;
- the scene's own lattice goes in as a particle file, one rest volume d^dimension each;
- its walls are sampled on their surface (Akinci et al. 2012), which holds the liquid about 0.6 spacings off; they are put that
  far behind the scene's walls (0.7 in a closed box: a vortex cell kept its speed best there), and a body's mesh that far inside
  it at the same mass, else the first steps explode;
- its threads wait for each other without spinning: spinning ones were up to 1.6 times faster on an idle machine, and 20 times
  slower on a shared one;
- field "p / rho^2" holds p dt^2 / rho_0 after a step, and "p_v / rho^2" holds p_v dt / rho_0.
"""

from __future__ import annotations

import atexit
import dataclasses
import functools
import importlib.util
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from tests.benchmarks.pareto import splishsplash_scene
from tests.benchmarks.pareto.measures import Double, Sample, fit_pressure
from tests.benchmarks.pareto.results import Family, Row, Variant, failure, outcome
from tests.benchmarks.pareto.scenes import SCENES, Scene

NAME = "SPlisHSPlasH"
MODULE = "pysplishsplash"
TIME_LIMIT = 150.0  # s of wall time after which a run is given up
SERIAL_BELOW = 2048  # particles; with fewer, one thread was faster than two, and this solver takes one as well
FASTEST = 100.0  # m/s; a run with a faster particle has exploded
FAMILIES = (
    Family(name="spacing", settings=({},), spacings="every"),
    Family(name="time step", settings=tuple({"cflMaxTimeStepSize": dt} for dt in (0.0025, 0.001)), spacings="every"),
    Family(name="tolerance", settings=tuple({"maxError": share, "maxErrorV": share} for share in (1.0, 0.01))),
    Family(name="volume maps", settings=({"boundaryHandlingMethod": 2},), scenes=("column", "dam", "vortices")),
    Family(name="one thread", settings=({"threads": 1},), spacings="finest", scenes=("dam", "box")),
)
GL_LIBRARIES = ("libGLdispatch", "libGLX", "libOpenGL")


def _imports(folder: str) -> str:
    """Why the module cannot be imported with `folder` before all others on the path; empty when it can."""
    program = f"import sys; sys.path[:0] = [p for p in [{folder!r}] if p]; import {MODULE}"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    if done.returncode < 0:
        return f"its import ends with {signal.Signals(-done.returncode).name}"
    return done.stderr.strip().splitlines()[-1] if done.returncode else ""


def _system_library(name: str) -> Path | None:
    folders = (Path(root) for root in ("/usr/lib/x86_64-linux-gnu", "/lib/x86_64-linux-gnu", "/usr/lib64", "/usr/lib"))
    return next((folder / f"{name}.so.0" for folder in folders if (folder / f"{name}.so.0").exists()), None)


def _with_system_libraries(module: Path, folder: Path) -> None:
    """Copy the module into `folder` with the system's OpenGL libraries in place of those in its wheel."""
    shutil.copy(module, folder)
    bundled = module.parent / f"{MODULE}.libs"
    target = folder / bundled.name
    shutil.copytree(bundled, target)
    for name in GL_LIBRARIES:
        system = _system_library(name)
        for library in target.glob(f"{name}-*") if system else ():
            library.unlink()
            library.symlink_to(system)


@functools.cache
def locate() -> tuple[str, str]:
    """The folder to import the module from (empty: as installed), and why it is of no use (empty: it works)."""
    specification = importlib.util.find_spec(MODULE)
    if specification is None or specification.origin is None:
        return "", f"{MODULE} is not installed (pip install -e '.[pareto]')"
    reason = _imports("")
    if not reason:
        return "", ""
    folder = tempfile.mkdtemp(prefix="pareto-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    _with_system_libraries(Path(specification.origin), Path(folder))
    again = _imports(folder)
    return folder, f"{reason}; with the system's OpenGL libraries: {again}" if again else ""


def _threads(particle_count: int) -> int:
    return len(os.sched_getaffinity(0)) if particle_count >= SERIAL_BELOW else 1


def run(scene: Scene, variant: Variant) -> Row:
    """Run a variant in a process of its own."""
    if scene.periodic:
        return failure(scene, variant, "it has no periodic boundaries")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        job = {"scene": scene.name, "variant": dataclasses.asdict(variant), "library": locate()[0]}
        (folder / "job.json").write_text(json.dumps(job))
        threads = variant.options.get("threads") or _threads(len(scene.particles(variant.spacing)))
        environment = os.environ | {"OMP_NUM_THREADS": str(threads), "OMP_WAIT_POLICY": "passive"}
        try:
            done = subprocess.run(
                [sys.executable, "-m", "tests.benchmarks.pareto.splishsplash", str(folder / "job.json")],
                env=environment, timeout=TIME_LIMIT, capture_output=True, text=True,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return failure(scene, variant, f"not done after {TIME_LIMIT:g} s")
        if not (folder / "result.json").exists():
            return failure(scene, variant, f"ended with code {done.returncode}: {done.stderr.strip()[-200:]}")
        result = json.loads((folder / "result.json").read_text())
    return Row(scene=scene.name, solver=variant.solver, family=variant.family, label=variant.label, **result)


class Run:
    """The library's simulation of a scene, ready to step."""

    def __init__(self, sph: Any, scene: Scene, variant: Variant, folder: Path) -> None:
        self.scene, self.spacing = scene, variant.spacing
        file = splishsplash_scene.write(scene, variant.spacing, variant.options, folder)
        self.base = sph.Exec.SimulatorBase()
        # stopAt above 0 ends the library's own loop after its first step; it must not be so small that it prints as 0
        self.base.init(
            sceneFile=str(file), useGui=False, initialPause=False, outputDir=str(folder / "output"), stopAt=1e-6
        )
        self.base.initSimulation()
        self.simulation = sph.Simulation.getCurrent()
        self.clock = sph.TimeManager.getCurrent()
        self.fluid = self.simulation.getFluidModel(0)
        self._set_velocity(scene, variant.spacing)
        self.base.runSimulation()
        self.base.setValueFloat(self.base.STOP_AT, -1.0)

    def _set_velocity(self, scene: Scene, spacing: float) -> None:
        """The particles' first velocities: the library reads them from the file and then overwrites them with the block's."""
        velocity = splishsplash_scene.to_library(scene.velocity(scene.particles(spacing)))
        for index, value in enumerate(velocity):  # in the file's order until the first step sorts them
            self.fluid.setVelocity(index, value)
            self.fluid.setVelocity0(index, value)

    def step(self, until: float) -> float:
        """Advance to `until` [s] or just beyond; the wall time it took [s]."""
        begin = time.perf_counter()
        while self.clock.getTime() < until - 1e-6:
            self.base.timeStepNoGUI()
        return time.perf_counter() - begin

    def field(self, name: str) -> Double:
        """A copy of a particle field; the library's buffers are longer than the liquid."""
        return np.array(self.fluid.getFieldBuffer(name), np.float64)[: self.fluid.numActiveParticles()]

    def sample(self) -> Sample:
        """What the solver-independent measures see."""
        position = splishsplash_scene.from_library(self.field("position"))
        dt = self.clock.getTimeStepSize()
        pressure = self.fluid.getDensity0() * (self.field("p / rho^2") / dt**2 + self.field("p_v / rho^2") / dt)
        height = float("nan")
        if self.scene.body is not None:
            height = float(self.simulation.getBoundaryModel(1).getRigidBodyObject().getPosition()[1])
        return Sample(
            time=self.clock.getTime(),
            position=position,
            velocity=splishsplash_scene.from_library(self.field("velocity")),
            pressure=fit_pressure(position, pressure, np.array(self.scene.probes).reshape(-1, 3), 2.0 * self.spacing),
            body_height=height,
        )


def worker(job_file: Path) -> None:
    """Run the job and leave `result.json` beside it."""
    job = json.loads(job_file.read_text())
    sys.path[:0] = [folder for folder in [job["library"]] if folder]
    scene, variant = SCENES[job["scene"]](), Variant(**job["variant"])
    simulation = Run(importlib.import_module(MODULE), scene, variant, job_file.parent)
    seconds, samples = [], []
    for step in range(1, round(scene.duration / scene.interval) + 1):
        seconds.append(simulation.step(step * scene.interval))
        samples.append(simulation.sample())
        speed = np.abs(samples[-1].velocity).max()
        if not speed < FASTEST:
            result: dict[str, Any] = {"note": f"exploded at {samples[-1].time:.2f} s"}
            break
    else:
        result = outcome(scene, variant, samples, seconds)
    (job_file.parent / "result.json").write_text(json.dumps(result))
    os._exit(0)  # the library's own end may hang without a display


if __name__ == "__main__":
    worker(Path(sys.argv[1]))
