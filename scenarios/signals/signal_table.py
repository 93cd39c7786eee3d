"""The signals of a run: numbers with a name and a unit that FMUs are connected to, and that an exported FMU has as its variables.

Names follow the scenario file: ``vessels.port.speed``, ``booms.main.port.tension``, ``sea.wind.speed``. The meaning of a
signal for the parts of a run stands beside its name, in one place. Positions are of the centre of mass; roll, pitch and yaw turn the body
about the world's x, y and z in this order; headings and directions are counter-clockwise from +x.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from oilsim.core.quantity import Quantity, quantities
from scenarios.schema.bodies import Body, Fixed
from scenarios.schema.exercise import BoomSettings, TowSettings, VesselSettings, body_of, segment_names
from scenarios.schema.moorings import MooringSettings, TieSettings
from scenarios.schema.recovery import SkimmerSettings
from scenarios.schema.sea import SeaSettings, SteadySeaCurrent, SteadySeaWind
from vessels.control import HELM_ORDERS, MACHINERY_ORDERS

if TYPE_CHECKING:
    from booms.recovery.skimming import SkimmingParticipant
    from coupling.bullet.rigid_body_world import RigidBodyWorld
    from coupling.multibody.mooring_leg import MooringLeg
    from oilsim.oil.ledger import OilLedger
    from vessels.control import ManualControl, VesselControl

Array = NDArray[np.float64]
POSE = (("x", "m"), ("y", "m"), ("z", "m"), ("roll", "rad"), ("pitch", "rad"), ("yaw", "rad"))
SKIMMED = (("encountered", "m3"), ("oil", "m3"), ("aboard", "m3"), ("rate", "m3/s"))
PUSH = (("thrust", "N"), ("side_thrust", "N"), ("yaw_moment", "N m"))


class SignalTables(Protocol):
    """The tables of a scenario that signals are about."""

    @property
    def bodies(self) -> Mapping[str, Body]:
        """Bodies by name."""

    @property
    def vessels(self) -> Mapping[str, VesselSettings]:
        """Vessels by name."""

    @property
    def booms(self) -> Mapping[str, BoomSettings]:
        """Booms by name."""

    @property
    def moorings(self) -> Mapping[str, MooringSettings]:
        """Mooring legs by name."""

    @property
    def ties(self) -> Mapping[str, TieSettings]:
        """Lines between booms by name."""

    @property
    def skimmers(self) -> Mapping[str, SkimmerSettings]:
        """Skimmers by name."""

    @property
    def tow(self) -> TowSettings | None:
        """Orders to all vessels without orders of their own."""

    @property
    def sea(self) -> SeaSettings | None:
        """Wind, waves and current."""


class ScoredBoom(Protocol):
    """The scores of one boom."""

    @property
    def name(self) -> str:
        """Name of the boom."""

    @property
    def values(self) -> Mapping[str, float]:
        """The scores at the last communication point by the names of their series; empty before the first."""


class Weather(Protocol):
    """The sea of a run."""

    def signal(self, kind: str, speed: float, direction: float) -> None:
        """Set the speed [m/s] and direction [rad] of the `wind` or the `current`."""


class Scores(Protocol):
    """The oil ledger, and the scores of all booms."""

    @property
    def ledger(self) -> OilLedger:
        """The oil of the run."""

    @property
    def booms(self) -> Sequence[ScoredBoom]:
        """The scores, one for each boom."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RunParts:
    """The parts of a run that signals read and change; `controls` by vessel, `tension_joints` by boom and end.

    sea: its wind and current; skimmers: by name.
    """

    sea: Weather
    world: RigidBodyWorld | None
    controls: Mapping[str, VesselControl | ManualControl]
    scoring: Scores
    tension_joints: Mapping[tuple[str, str], str]
    skimmers: Mapping[str, SkimmingParticipant] = field(default_factory=dict)

    def body(self, name: str) -> tuple[Array, Array]:
        """Return pose (7,) [m, 1] and twist (6,) [m/s, rad/s] of a body."""
        assert self.world is not None  # who names a moving body has a world
        return self.world.pose(name), self.world.twist(name)


Read = Callable[[RunParts], float]
Write = Callable[[RunParts, Mapping[str, float]], None]


@dataclass(frozen=True, kw_only=True, eq=False)
class Signal:
    """One number of a run.

    An output has `read`. An input has `write`, which applies it, given the values of all inputs by name; `start`, the value in the
    scenario; and `limits`, those of the key in a scenario file.
    """

    name: str
    unit: str
    read: Read | None = None
    write: Write | None = None
    start: float = 0.0
    limits: Quantity | None = None

    @property
    def is_input(self) -> bool:
        """True for an input of the run."""
        return self.write is not None


def signals_of(exercise: SignalTables) -> dict[str, Signal]:
    """List all signals of a scenario by name."""
    found = [*_tow(exercise), *_weather(exercise.sea)]
    for name, vessel in exercise.vessels.items():
        found += [*_orders(name, vessel), *_vessel(name)]
    for name, boom in exercise.booms.items():
        found += _boom(name, boom)
    for name in exercise.moorings:
        for what, unit in (("tension", "N"), ("dragged", "m")):
            found.append(Signal(name=f"moorings.{name}.{what}", unit=unit, read=partial(_leg, name, what)))
    for name in exercise.ties:
        found.append(Signal(name=f"ties.{name}.tension", unit="N", read=partial(_tied, name)))
        found.append(Signal(name=f"ties.{name}.distance", unit="m", read=partial(_apart, name)))
    for name in exercise.skimmers:
        for what, unit in SKIMMED:
            found.append(Signal(name=f"skimmers.{name}.{what}", unit=unit, read=partial(_skimmed, name, what)))
    for name, body in exercise.bodies.items():
        if not isinstance(body.motion, Fixed):
            found += _pose(f"bodies.{name}", name)
    return {signal.name: signal for signal in found}


def _tow(exercise: SignalTables) -> Iterator[Signal]:
    """Yield the orders of [tow], to every vessel whose helmsman has no orders of its own."""
    followers = [
        name for name, v in exercise.vessels.items() if v.control == "helmsman" and not (v.legs or v.waypoints)
    ]
    tow = exercise.tow
    if tow is None or not followers:
        return
    at_first = tow.speed if tow.start == 0.0 else 0.0  # they wait in their places
    for what, start in (("speed", at_first), ("heading", tow.heading)):
        order = partial(_order, [(name, f"{what}_order") for name in followers], f"tow.{what}")
        yield _input(f"tow.{what}", quantities(TowSettings)[what], order, start)


def _orders(name: str, vessel: VesselSettings) -> Iterator[Signal]:
    """Yield the orders of a vessel that has its own, or no helmsman."""
    if vessel.control == "manual":
        starts = dict.fromkeys(MACHINERY_ORDERS, 0.0)
    elif vessel.legs:
        starts = {"speed_order": vessel.legs[0].speed, "heading_order": vessel.legs[0].heading}
    else:
        return
    for what, start in starts.items():
        signal = f"vessels.{name}.{what}"
        limits = (MACHINERY_ORDERS | HELM_ORDERS)[what]
        yield _input(signal, limits, partial(_order, [(name, what)], signal), start)


def _input(name: str, limits: Quantity, write: Write, start: float = 0.0) -> Signal:
    return Signal(name=name, unit=limits.unit, write=write, start=start, limits=limits)


def _order(told: list[tuple[str, str]], signal: str, parts: RunParts, values: Mapping[str, float]) -> None:
    """Give vessels an order; `told` has the names of vessel and order."""
    for vessel, order in told:
        parts.controls[vessel].set(f"{vessel}.{order}", np.array(values[signal]))


def _vessel(name: str) -> Iterator[Signal]:
    """Yield the pose, motion and thrust of a vessel."""
    yield from _pose(f"vessels.{name}", body_of(name))
    for index, (what, unit) in enumerate((("speed", "m/s"), ("drift", "m/s"), ("turn_rate", "rad/s"))):
        yield Signal(name=f"vessels.{name}.{what}", unit=unit, read=partial(_planar, body_of(name), index))
    for what, unit in PUSH:
        yield Signal(name=f"vessels.{name}.{what}", unit=unit, read=partial(_push, name, what))


def _planar(body: str, index: int, parts: RunParts) -> float:
    """Return speed along a body's heading and to port of it [m/s], or rate of turn [rad/s]."""
    pose, twist = parts.body(body)
    yaw = attitude(pose)[2]
    c, s = math.cos(yaw), math.sin(yaw)
    return float((c * twist[0] + s * twist[1], c * twist[1] - s * twist[0], twist[5])[index])


def _push(vessel: str, what: str, parts: RunParts) -> float:
    return float(parts.controls[vessel].get(f"{vessel}.{what}"))


def _boom(name: str, boom: BoomSettings) -> Iterator[Signal]:
    """Yield tensions and winches at a boom's ends, and the poses of its segments."""
    for end, label in zip(boom.ends, boom.end_labels, strict=True):
        prefix = f"booms.{name}.{label}"
        yield Signal(name=f"{prefix}.tension", unit="N", read=partial(_tension, name, label))
        if boom.line_stiffness is not None and isinstance(end, str):
            order = partial(_pay_out, name, label, f"{prefix}.payout")
            yield _input(f"{prefix}.payout", Quantity(unit="m"), order)  # the line refuses a length that is not above 0
    for index, segment in enumerate(segment_names(name, boom.segments)):
        yield from _pose(f"booms.{name}.segment-{index:02d}", segment)


def _tension(boom: str, end: str, parts: RunParts) -> float:
    """Return the tow tension [N], the mean over the last step."""
    assert parts.world is not None
    return parts.world.tension(parts.tension_joints[boom, end])


def _leg(mooring: str, what: str, parts: RunParts) -> float:
    """Return the tension [N] of a mooring leg, or how far [m] its anchor has dragged."""
    assert parts.world is not None
    return float(getattr(cast("MooringLeg", parts.world.lines[f"moorings/{mooring}"]), what))


def _tied(tie: str, parts: RunParts) -> float:
    """Return the tension [N] of a tie, the mean over the last step."""
    assert parts.world is not None
    return parts.world.tension(f"ties/{tie}")


def _apart(tie: str, parts: RunParts) -> float:
    """Return the distance [m] of the two points of a tie."""
    assert parts.world is not None
    return parts.world.line_distance(f"ties/{tie}")


def _skimmed(skimmer: str, what: str, parts: RunParts) -> float:
    """Return a sum [m3] or the rate [m3/s] of a skimmer; 0 in a run without oil on the water."""
    return float(parts.skimmers[skimmer].get(what)) if skimmer in parts.skimmers else 0.0


def _pay_out(boom: str, end: str, signal: str, parts: RunParts, values: Mapping[str, float]) -> None:
    """Set the length [m] of line that is paid out beyond the laid length by the end of the coming step."""
    assert parts.world is not None
    line = parts.tension_joints[boom, end]
    parts.world.lines.order_length(line, parts.world.lines.laid_length(line) + values[signal])


def _pose(prefix: str, body: str) -> Iterator[Signal]:
    for index, (what, unit) in enumerate(POSE):
        yield Signal(name=f"{prefix}.{what}", unit=unit, read=partial(_coordinate, body, index))


def _coordinate(body: str, index: int, parts: RunParts) -> float:
    pose = parts.body(body)[0]
    return float(pose[index]) if index < 3 else attitude(pose)[index - 3]


def attitude(pose: Array) -> tuple[float, float, float]:
    """Return roll, pitch and yaw [rad] of a pose (7,) [m, 1]."""
    x, y, z, w = (float(part) for part in pose[3:])
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = math.asin(min(max(2.0 * (w * y - z * x), -1.0), 1.0))
    return roll, pitch, math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def _weather(sea: SeaSettings | None) -> Iterator[Signal]:
    """Yield wind and current, if the scenario has steady ones."""
    for kind in ("wind", "current"):
        settings = getattr(sea, kind, None)
        if isinstance(settings, SteadySeaWind | SteadySeaCurrent):
            limits, write = quantities(type(settings)), partial(_stream, kind)
            yield _input(f"sea.{kind}.speed", limits["speed"], write, settings.speed)
            yield _input(f"sea.{kind}.direction", limits["direction"], write, settings.direction)


def _stream(kind: str, parts: RunParts, values: Mapping[str, float]) -> None:
    """Set the wind or the current."""
    parts.sea.signal(kind, values[f"sea.{kind}.speed"], values[f"sea.{kind}.direction"])
