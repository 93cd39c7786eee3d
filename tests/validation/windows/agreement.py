"""The table of agreement of windows: one boom with oil, moored in a current, the same in waves, and towed, computed in several ways.

    python -m tests.validation.windows.agreement [--resolution 2] [--condition current ...] [--way everywhere ...] [--folder FOLDER]

runs what FOLDER does not hold yet, one run after the other, and prints the table of all that it holds. A run ends with a file, so a
series that was ended goes on with the run that it was in. The boom is that of case 34: 12 m, with a skirt of 0.45 m, `resolution` spacings
deep. The mean values of the last 8 of 24 s count, and the oil that has passed by then.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from booms.boom_state import BoomState
from scenarios.running.assembly import Assembly, build
from scenarios.schema.exercise import TowSettings, VesselSettings
from scenarios.schema.liquid import BlockFill, PhaseSettings, SlabFill
from scenarios.schema.sea import SteadySeaCurrent, horizontal
from scenarios.schema.window import WindowTable
from scenarios.spec.scenario import Scenario
from tests.validation.bodies.without_particles import (
    APEX,
    ASLEEP,
    COUNTED,
    DEPTH,
    DURATION,
    GAP,
    HEIGHT,
    LENGTH,
    SKIRT,
    WIDTH,
    WINDOW,
    WINDOW_DEPTH,
    bare,
    boom_scene,
)

Double = NDArray[np.float64]

CONDITIONS = ("current", "waves", "towed")
STEP = 0.04  # s: short enough that windows need no slope of the pressure at rest (`oilsim.pressure.rest_pressure`)
SPEED = 0.5  # m/s of the water past the boom: above the first loss of oil, which is at 0.36 m/s
LARGER = 4.0 / 3.0  # [1] size of a larger window over that of the window itself
AROUND = LARGER * WINDOW  # [m] size of the window around the whole U
MIDDLE = 9.35  # [m] x of the middle of the U
AHEAD = 4.7  # [m] that a window on the apex of a towed boom needs more, ahead and behind, to hold the whole U
OIL = PhaseSettings(density=900.0, dynamic_viscosity=0.05, interfacial_tension=0.02)
POOL = (7.6, 9.4), (3.6, 5.4), 0.25  # m: the oil at the start, in x, in y, and its thickness, to whole spacings
FLOATS = {2: 2.5}  # gross buoyancy to weight where a skirt of few, thick particles allows no more; else 3
TOWED_BASIN = 18.0  # m: the sea that repeats, long enough that the boom does not meet its own wake
TUG = {
    "length": 2.4,
    "beam": 1.0,
    "draft": 0.45,
    "depth": 0.9,
    "bollard_pull": 1500.0,
    "yaw_moment": 600.0,
    "side_thrust": 600.0,
}
TOW_LINE = 1.0  # m
FOLDER = Path("validation-report/window-agreement")


@dataclass(frozen=True, kw_only=True)
class Found:
    """What one run gives.

    particles at the end; tension [N]: mean of both ends, and its scatter; normal_speed [m/s] of the water against the apex; released,
    passed, modelled, owed [m3]: oil at the start, that has passed the boom, the part of it that closures carried out, and the integral
    of the closures' rate (NaN where parcels have it in `passed`); line (S + 1, 2) [m]: mean line, towed about its middle; cpu [s].
    """

    particles: int
    tension: float
    scatter: float
    normal_speed: float
    released: float
    passed: float
    modelled: float
    owed: float
    line: list[list[float]]
    cpu: float


def scene(condition: str, resolution: int) -> Scenario:
    """The scene with particles everywhere."""
    spacing = SKIRT / resolution
    moored = boom_scene(spacing, 1, HEIGHT if condition == "waves" else 0.0)
    boom = replace(moored.booms["main"], buoyancy_to_weight=FLOATS.get(resolution, 3.0))
    layers = max(1, round(POOL[2] / spacing))
    (west, east), (south, north) = POOL[:2]
    drift = (0.0 if condition == "towed" else -SPEED, 0.0, 0.0)
    water = SlabFill(phase="water", bottom=0.0, top=DEPTH, velocity=drift)
    oil = BlockFill(
        phase="oil", lower=(west, south, DEPTH - layers * spacing), upper=(east, north, DEPTH), velocity=drift
    )
    filled = replace(
        moored,
        run=replace(moored.run, communication_step=STEP),
        fluid=replace(moored.fluid, maximum_time_step=STEP),
        booms={"main": boom},
        phases=dict(moored.phases) | {"oil": OIL},
        fill={"water": water, "slick": oil},
    )
    current = filled.sea.current
    assert isinstance(current, SteadySeaCurrent)
    if condition != "towed":
        return replace(filled, sea=replace(filled.sea, current=replace(current, speed=SPEED)))
    return _towed(filled)


def _towed(moored: Scenario) -> Scenario:
    """The boom of a scene behind two tugs that make SPEED through still water."""
    boom = moored.booms["main"]
    bow = boom.ends[0][0] + TOW_LINE + 0.5 * TUG["length"]
    sides = {"port": 0.5 * (WIDTH + GAP), "starboard": 0.5 * (WIDTH - GAP)}
    tugs = {name: VesselSettings(position=(bow, y), heading=0.0, **TUG) for name, y in sides.items()}
    upper = (TOWED_BASIN, *moored.tank.upper[1:])
    return replace(
        moored,
        tank=replace(moored.tank, upper=upper),
        sea=replace(moored.sea, current=None, waves=None),
        vessels=tugs,
        tow=TowSettings(speed=SPEED, heading=0.0),
        booms={"main": replace(boom, ends=("port", "starboard"), tow_line=TOW_LINE, stream=math.pi)},
    )


def _windowed(whole: Scenario, window: WindowTable) -> Scenario:
    fluid = replace(whole.fluid, sleep_speed=ASLEEP, maximum_time_step=None)
    return replace(whole, window=window, fluid=fluid)


def _table(condition: str, around: bool, larger: float = 1.0, aside: float = 0.0) -> WindowTable:
    """A window on the apex or around the U, larger by a factor, moved upstream by `aside` [m]; its rim is that of the window as it is."""
    side = AROUND if around else WINDOW
    size, rim = (larger * side, larger * side), (0.25 * WINDOW)
    depth = DEPTH if around else WINDOW_DEPTH
    if condition != "towed":
        return WindowTable(target=((MIDDLE if around else APEX) + aside, 0.5 * WIDTH), size=size, depth=depth, rim=rim)
    if around:
        size = (size[0] + AHEAD, size[1])
    return WindowTable(target="main", size=size, depth=depth, rim=rim)


WAYS: Mapping[str, Callable[[str, Scenario], Scenario]] = {
    "everywhere": lambda condition, whole: whole,
    "around": lambda condition, whole: _windowed(whole, _table(condition, True)),
    "apex": lambda condition, whole: _windowed(whole, _table(condition, False)),
    "formulas": lambda condition, whole: bare(whole),
    "around, larger": lambda condition, whole: _windowed(whole, _table(condition, True, LARGER)),
    "apex, larger": lambda condition, whole: _windowed(whole, _table(condition, False, LARGER)),
    "around, moved": lambda condition, whole: _windowed(whole, _table(condition, True, 1.0, 0.5 * AROUND)),
    "apex, moved": lambda condition, whole: _windowed(whole, _table(condition, False, 1.0, 0.5 * WINDOW)),
}
MOORED_ONLY = ("around, moved", "apex, moved")  # a window that follows a boom has its middle segment in its middle


class Reader:
    """Reads a run step by step."""

    def __init__(self, assembly: Assembly) -> None:
        self._assembly, self._layout = assembly, assembly.fleet.booms["main"]
        self._joints = list(assembly.fleet.tensions_of("main").values())
        self._names = [segment.name for segment in self._layout.segments]
        self._current = np.array(horizontal(*assembly.scenario.sea.steady_current))
        self.tension, self.speed, self.line, self.owed = list[float](), list[float](), list[Double](), 0.0

    def count_owed(self) -> None:
        """Add what the closures owe of this step."""
        closures = self._assembly.scoring.booms[0].closures
        self.owed += math.nan if closures is None else STEP * closures.rate

    def read(self) -> None:
        """Take this step in."""
        world = self._assembly.world
        assert world is not None
        poses = world.poses(self._names)
        state = BoomState(
            position=poses[:, :3], orientation=poses[:, 3:], velocity=world.twists(self._names)[:, :3],
            joint_points=self._layout.segment.joint_points, waterline=self._layout.segment.waterline,
        )  # fmt: skip
        self.tension.append(float(np.mean([world.tension(joint) for joint in self._joints])))
        self.speed.append(float(state.normal_flow(self._current)[len(self._names) // 2]))
        self.line.append(state.line())

    def found(self, cpu: float) -> Found:
        """Return what the run gives; cpu [s] of one processor that it took."""
        assembly, lines = self._assembly, np.array(self.line)
        oil, ledger = assembly.scoring.booms[0].oil, assembly.scoring.ledger.rows
        if assembly.scenario.vessels:
            lines = lines - lines.mean(axis=1, keepdims=True)
        return Found(
            particles=sum(count for name, count in assembly.particle_counts().items() if name != "boundary"),
            tension=float(np.mean(self.tension)),
            scatter=float(np.std(self.tension)),
            normal_speed=abs(float(np.mean(self.speed))),
            released=ledger.spilled,
            passed=oil.passed,
            modelled=oil.passed_modelled,
            owed=self.owed,
            line=lines.mean(axis=0).tolist(),
            cpu=cpu,
        )


def run(scenario: Scenario) -> Found:
    """Run a scene to its end."""
    assembly = build(scenario)
    simulation, reader = assembly.co_simulation(), Reader(assembly)
    begin = time.process_time()
    simulation.initialize()
    for index in range(round(DURATION / STEP)):
        simulation.step()
        reader.count_owed()
        if index * STEP >= DURATION - COUNTED:
            reader.read()
    found = reader.found(time.process_time() - begin)
    simulation.terminate()
    return found


def measured(folder: Path, resolution: int, condition: str, way: str) -> Found | None:
    """The run that a folder holds; None if it does not."""
    path = _path(folder, resolution, condition, way)
    return Found(**json.loads(path.read_text())) if path.exists() else None


def _path(folder: Path, resolution: int, condition: str, way: str) -> Path:
    return folder / f"{resolution}-{condition}-{way.replace(', ', '-')}.json"


def shape_apart(one: Found, other: Found) -> float:
    """Root mean square distance of the mean lines, in per cent of the boom's length."""
    apart = np.array(one.line) - np.array(other.line)
    return 100.0 * float(np.sqrt((apart**2).sum(axis=1).mean())) / LENGTH


def lines_of(folder: Path, resolution: int, condition: str) -> list[str]:
    """The rows of the table of a condition, against particles everywhere where these have been run."""
    whole, rows = measured(folder, resolution, condition, "everywhere"), list[str]()
    for way in WAYS:
        one = measured(folder, resolution, condition, way)
        if one is None:
            continue
        share, owed = 100.0 * one.passed / one.released, 100.0 * one.owed / one.released
        cells = [condition, way, f"{one.particles:,}", f"{one.tension:.0f} ± {one.scatter:.0f}"]
        cells += (
            ["", ""] if whole is None else [f"{one.tension / whole.tension:.3f}", f"{shape_apart(one, whole):.1f} %"]
        )
        cells += [f"{one.normal_speed:.3f}", f"{share:.1f} %", f"{100.0 * one.modelled / one.released:.1f} %"]
        rows.append(" | ".join(["", *cells, "" if math.isnan(owed) else f"{owed:.1f} %", f"{one.cpu:.0f}", ""]).strip())
    return rows


HEADER = (
    "| | computed by | particles | tension of an end [N] | of that everywhere | shape off, of the length | normal speed at the apex [m/s] |"
    " oil passed | modelled | owed by closures | processor [s] |"
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run what is missing and print the table."""
    parser = argparse.ArgumentParser(description="Windows against particles everywhere.")
    parser.add_argument("--resolution", type=int, default=2, help="spacings to the skirt of 0.45 m")
    parser.add_argument("--condition", nargs="*", choices=CONDITIONS, default=CONDITIONS, help="default all")
    parser.add_argument("--way", nargs="*", choices=tuple(WAYS), default=tuple(WAYS), help="default all")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="of the runs")
    options = parser.parse_args(arguments)
    options.folder.mkdir(parents=True, exist_ok=True)
    for condition in options.condition:
        for way in options.way:
            known = measured(options.folder, options.resolution, condition, way)
            if known is not None or (condition == "towed" and way in MOORED_ONLY):
                continue
            found = run(WAYS[way](condition, scene(condition, options.resolution)))
            _path(options.folder, options.resolution, condition, way).write_text(json.dumps(asdict(found)))
            print(f"{condition}, {way}: {found.cpu:.0f} s", flush=True)
    print(HEADER, "|---" * 11 + "|", sep="\n")
    for condition in CONDITIONS:
        print("\n".join(lines_of(options.folder, options.resolution, condition)))


if __name__ == "__main__":
    main()
