"""A random scene is run and held to what physics allows, whatever it is made of.

end          no participant fails, no number becomes infinite, no exchange makes energy
speed        nothing becomes many times faster than what drives it
energy       of liquid and bodies never exceeds what they began with, where nothing drives them
mass         closed sides hold the liquid
bodies       closed sides hold them too
same again   a second run from a saved state, on two threads, is the same, bit for bit
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from coupling.master.co_simulation import CoSimulation
from coupling.master.errors import CoSimulationError
from scenarios.running.assembly import Assembly, build
from scenarios.running.checkpoints import begin_from, run_state, run_state_hash
from scenarios.schema.bodies import Fixed, Free
from scenarios.schema.sea import SteadySeaWind
from scenarios.spec.load import scenario_from
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import ScenarioError

FASTEST = 6.0  # times what drives it: jets of a splash in a corner reach three times
MADE = 0.02  # of the energy of the reference speed, beside what a step's flight runs ahead of its forces
LEAKED = 3e-3  # of the particles, and one: squeezed into a wall by something fast in a single step
SOME = 12  # communication steps from a saved state that are run a second time


@dataclass
class Trial:
    """What became of a scene: refused (why its scenario cannot be built), or faults by name; largest figures for the record."""

    seed: int
    particles: int = 0
    refused: str = ""
    faults: dict[str, str] = field(default_factory=dict)
    figures: dict[str, float] = field(default_factory=dict)

    def note(self, name: str, value: float, limit: float) -> None:
        """Keep the largest of a figure; beyond its limit it is a fault."""
        if value > self.figures.get(name, -math.inf):
            self.figures[name] = value
            if value > limit:
                self.faults[name] = f"{value:.3g}, allowed: {limit:.3g}"


def run_trial(seed: int, data: Mapping[str, Any], make: Callable[[Scenario], Assembly] = build) -> Trial:
    """Run a scene to its end, and a part of it once more; `make` makes what a scenario runs in."""
    trial = Trial(seed)
    try:
        scenario = scenario_from(data)
        assembly = make(scenario)
    except ScenarioError as error:
        trial.refused = str(error)
        return trial
    trial.particles = assembly.fluid.particle_count
    simulation = assembly.co_simulation()
    watch = _Watch(scenario, assembly, trial)
    try:
        simulation.initialize()
        watch.step(simulation, SOME)
        saved = run_state(simulation, assembly)
        watch.step(simulation, SOME)
        first = run_state_hash(simulation, assembly)
        watch.step(simulation, math.ceil(scenario.run.duration / scenario.run.communication_step) - 2 * SOME)
    except CoSimulationError as error:
        trial.faults["end"] = str(error)
        return trial
    simulation.terminate("completed")
    if _resumed(make(replace(scenario, run=replace(scenario.run, threads=2))), saved) != first:
        trial.faults["same again"] = "another state on two threads, allowed: the same bits"
    return trial


def _resumed(assembly: Assembly, saved: Mapping[str, Any]) -> str:
    """The hash of the state SOME steps after a saved one."""
    simulation = assembly.co_simulation()
    begin_from(saved, simulation, assembly)
    for _ in range(SOME):
        simulation.step()
    result = run_state_hash(simulation, assembly)
    simulation.terminate("completed")
    return result


class _Watch:
    """Looks at a run after every communication step."""

    def __init__(self, scenario: Scenario, assembly: Assembly, trial: Trial) -> None:
        self._scenario, self._assembly, self._trial = scenario, assembly, trial
        self._size = np.subtract(scenario.tank.upper, scenario.tank.lower)
        self._gravity = float(np.linalg.norm(scenario.fluid.gravity))
        self._speed = self._reference_speed()
        self._mass = self._masses()
        self._driven = _is_driven(scenario)
        self._first_energy = self._energy()
        self._lost, self._longest = 0, 0.0  # particles; s, of a step

    def step(self, simulation: CoSimulation, steps: int) -> None:
        """Take so many communication steps and look at each."""
        for _ in range(steps):
            simulation.step()
            self._look()

    def _look(self) -> None:
        fluid, trial = self._assembly.fluid, self._trial
        report = self._assembly.report()
        assert report is not None
        if fluid.particle_count:
            fastest = float(np.sqrt((fluid.particles.velocity.astype(np.float64) ** 2).sum(axis=0).max()))
            trial.note("speed", fastest / self._speed, FASTEST)
        if not self._driven:
            self._longest = max(self._longest, report.time_step)
            ahead = self._gravity * self._longest / self._speed
            scale = 0.5 * self._mass * self._speed**2
            trial.note("energy", (self._energy() - self._first_energy) / scale, MADE + ahead)
        if not self._scenario.tank.open:
            self._lost += sum(report.removed.values())
            trial.note("mass", self._lost / max(trial.particles, 1), LEAKED + 1.0 / max(trial.particles, 1))
        trial.note("compression", report.density_error, math.inf)
        trial.note("products", report.iterations["divergence"], math.inf)
        self._look_at_bodies()

    def _look_at_bodies(self) -> None:
        world, trial = self._assembly.world, self._trial
        if world is None:
            return
        for name in world.free_body_names:
            trial.note("body's speed", float(np.linalg.norm(world.twist(name)[:3])) / self._speed, FASTEST)
            place, tank = world.pose(name)[:3], self._scenario.tank
            for side in tank.closed_sides:
                axis = "xyz".index(side[1])
                behind = tank.lower[axis] - place[axis] if side[0] == "-" else place[axis] - tank.upper[axis]
                trial.note("bodies", behind / self._scenario.fluid.particle_spacing, 0.0)

    def _energy(self) -> float:
        energy, world = self._assembly.fluid.energy(), self._assembly.world
        return energy.kinetic + energy.potential + (0.0 if world is None else world.energy())

    def _masses(self) -> float:
        fluid, world = self._assembly.fluid, self._assembly.world
        densities = np.array([phase.rest_density for phase in fluid.config.phases])
        mass = fluid.config.rest_volume * float(densities[fluid.particles.phase].sum())
        free = () if world is None else world.free_body_names
        return mass + sum(float(world.mass_matrix(name)[0, 0]) for name in free if world is not None)

    def _reference_speed(self) -> float:
        """That of a fall through the tank, together with all that is set in motion or sets in motion."""
        scenario = self._scenario
        fall = 2.0 * self._gravity * float(np.linalg.norm(self._size))
        slow = 1e-2 * math.sqrt(max(self._gravity, 1.0) * scenario.fluid.particle_spacing)
        return math.sqrt(fall + sum(speed**2 for speed in _speeds(scenario)) + slow**2)


def _speeds(scenario: Scenario) -> Iterator[float]:
    """Speeds that are in a scenario from the start, or kept up in it."""
    for region in scenario.fill.values():
        yield float(np.linalg.norm(region.velocity or 0.0))
    for body in scenario.bodies.values():
        yield float(np.linalg.norm(body.velocity))
        motion = body.motion
        yield float(np.linalg.norm(getattr(motion, "velocity", 0.0)))
        yield 2.0 * math.pi * getattr(motion, "amplitude", 0.0) / getattr(motion, "period", 1.0)
    for pipe in scenario.emitters.values():
        yield pipe.speed
    for phase in scenario.phases.values():
        yield math.sqrt(2.0 * phase.adhesion / (phase.rest_density * scenario.fluid.particle_spacing))
    yield scenario.sea.steady_current[0]
    if isinstance(scenario.sea.wind, SteadySeaWind):
        yield 0.1 * scenario.sea.wind.speed


def _is_driven(scenario: Scenario) -> bool:
    """Whether anything but gravity does work."""
    weather = (scenario.sea.wind, scenario.sea.current, scenario.sea.waves)
    sticky = any(phase.adhesion for phase in scenario.phases.values())
    led = any(not isinstance(body.motion, Free | Fixed) for body in scenario.bodies.values())
    return bool(scenario.emitters) or any(each is not None for each in weather) or led or sticky


def as_toml(data: Mapping[str, Any], path: str = "") -> str:
    """Plain data as a scenario file: numbers, texts, lists and truth values are written in TOML as in JSON."""
    lines = [f"{key} = {json.dumps(value)}" for key, value in data.items() if not isinstance(value, Mapping)]
    text = "\n".join(([f"\n[{path}]"] if path and lines else []) + lines) + "\n" * bool(lines)
    for key, value in data.items():
        if isinstance(value, Mapping):
            text += as_toml(value, f"{path}.{key}" if path else key)
    return text
