"""The signals of a run: numbers with a name and a unit that FMUs are connected to, and that an exported FMU has as its variables.

Names follow the scenario file: ``vessels.port.speed``, ``booms.main.port.tension``, ``sea.wind.speed``. The meaning of a
signal for the parts of a run stands beside its name, in one place. Positions are of the centre of mass; roll, pitch and yaw turn the body
about the world's x, y and z in this order; headings and directions are counter-clockwise from +x.

A board is the participant to which the FMUs of a scenario are connected.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Protocol, cast

import numpy as np

from coupling.master.participant import (
    Causality,
    Participant,
    Status,
    StepResult,
    Variable,
    checked_value,
    variable_table,
)
from oilsim.backend.arrays import Array
from oilsim.core.quantity import Quantity, quantities
from oilsim.oil.ledger import BoomOil, OilRows
from scenarios.controls.table import driven_entries
from scenarios.schema.bodies import Fixed
from scenarios.schema.exercise import BoomSettings, body_of, segment_names
from scenarios.schema.tables import Parts

if TYPE_CHECKING:
    from booms.recovery.skimming import SkimmingParticipant
    from coupling.bullet.rigid_body_world import RigidBodyWorld
    from coupling.multibody.mooring_leg import MooringLeg
    from oilsim.oil.ledger import OilLedger
    from vessels.control import ManualControl, VesselControl

POSE = (("x", "m"), ("y", "m"), ("z", "m"), ("roll", "rad"), ("pitch", "rad"), ("yaw", "rad"))
SKIMMED = (("encountered", "m3"), ("oil", "m3"), ("aboard", "m3"), ("rate", "m3/s"))
PUSH = (("thrust", "N"), ("side_thrust", "N"), ("yaw_moment", "N m"))
SHAPE = {"gap_ratio": "1", "normal_speed": "m/s", "effective_draft": "m", "skirt_angle": "rad"}
SPEEDS = ("normal_speed_held", "first_loss_speed", "gross_loss_speed")


class ScoredBoom(Protocol):
    """The scores of one boom."""

    @property
    def name(self) -> str:
        """Name of the boom."""

    @property
    def values(self) -> Mapping[str, float]:
        """The scores at the last communication point by the names of their series; empty before the first."""


class Scores(Protocol):
    """The oil ledger, and the scores of all booms."""

    @property
    def ledger(self) -> OilLedger:
        """The oil of the run."""

    @property
    def oil_in_areas(self) -> Mapping[str, float]:
        """The oil [m3] in each sensitive area."""

    @property
    def booms(self) -> Sequence[ScoredBoom]:
        """The scores, one for each boom."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RunParts:
    """The parts of a run that signals read, and `drive`, by which they set entries of the scenario, None: as ordered.

    helms: by vessel; tension_joints: by boom and end; skimmers: by name.
    """

    world: RigidBodyWorld | None
    helms: Mapping[str, VesselControl | ManualControl]
    scoring: Scores
    tension_joints: Mapping[tuple[str, str], str]
    drive: Callable[[Mapping[str, float | None]], None]
    skimmers: Mapping[str, SkimmingParticipant] = field(default_factory=dict)

    def body(self, name: str) -> tuple[Array, Array]:
        """Return pose (7,) [m, 1] and twist (6,) [m/s, rad/s] of a body."""
        assert self.world is not None  # who names a moving body has a world
        return self.world.pose(name), self.world.twist(name)


Read = Callable[[RunParts], float]


@dataclass(frozen=True, kw_only=True, eq=False)
class Signal:
    """One number of a run.

    An output has `read`. An input sets the entry of the scenario that it is called after; it has `start`, the value there, and `limits`.
    """

    name: str
    unit: str
    read: Read | None = None
    start: float = 0.0
    limits: Quantity | None = None

    @property
    def is_input(self) -> bool:
        """True for an input of the run."""
        return self.read is None


def signals_of(exercise: Parts) -> dict[str, Signal]:
    """List all signals of a scenario by name: its controls that may be driven, what its parts read, its oil ledger and scores."""
    found = list[Signal]()
    for path, section, value in driven_entries(exercise):
        limits = quantities(type(section))[path.rpartition(".")[2]]
        found.append(Signal(name=path, unit=limits.unit, start=value, limits=limits))
    for name in exercise.vessels:
        found += _vessel(name)
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
    for name in exercise.booms:
        found += _scores(name)
    for name in exercise.areas:
        found.append(Signal(name=f"areas.{name}.oil", unit="m3", read=partial(_in_area, name)))
    for series in OilRows().series() if exercise.booms else ():
        found.append(Signal(name=series.replace("/", "."), unit="m3", read=partial(_row, series)))
    return {signal.name: signal for signal in found}


def _vessel(name: str) -> Iterator[Signal]:
    """Yield the pose, motion and thrust of a vessel."""
    yield from _pose(f"vessels.{name}", body_of(name))
    for index, (what, unit) in enumerate((("speed", "m/s"), ("drift", "m/s"), ("turn_rate", "rad/s"))):
        yield Signal(name=f"vessels.{name}.{what}", unit=unit, read=partial(_planar, body_of(name), index))
    for what, unit in PUSH:
        yield Signal(name=f"vessels.{name}.{what}", unit=unit, read=partial(_push, name, what))


def _in_area(name: str, parts: RunParts) -> float:
    """Return the oil [m3] in a sensitive area."""
    return parts.scoring.oil_in_areas[name]


def _planar(body: str, index: int, parts: RunParts) -> float:
    """Return speed along a body's heading and to port of it [m/s], or rate of turn [rad/s]."""
    pose, twist = parts.body(body)
    yaw = attitude(pose)[2]
    c, s = math.cos(yaw), math.sin(yaw)
    return float((c * twist[0] + s * twist[1], c * twist[1] - s * twist[0], twist[5])[index])


def _push(vessel: str, what: str, parts: RunParts) -> float:
    return float(parts.helms[vessel].get(f"{vessel}.{what}"))


def _boom(name: str, boom: BoomSettings) -> Iterator[Signal]:
    """Yield tensions at a boom's ends, and the poses of its segments."""
    for label in boom.end_labels:
        yield Signal(name=f"booms.{name}.{label}.tension", unit="N", read=partial(_tension, name, label))
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


def _scores(boom: str) -> Iterator[Signal]:
    """Yield volumes of oil, also by cause, and in all by closures; the boom's shape; speeds, of first and gross loss 0 until then."""
    volumes = [series for series in BoomOil().series() if not series.startswith("oil_lost_modelled/")]
    units = dict.fromkeys(volumes, "m3") | {"oil_contained_share": "1"} | SHAPE | dict.fromkeys(SPEEDS, "m/s")
    for series, unit in units.items():
        start = 1.0 if series == "oil_contained_share" else 0.0
        name = f"booms.{boom}.{series.replace('/', '.')}"
        yield Signal(name=name, unit=unit, read=partial(_value, boom, series, start))


def _value(boom: str, series: str, start: float, parts: RunParts) -> float:
    score = next(score for score in parts.scoring.booms if score.name == boom)
    return score.values.get(series, start)


def _row(series: str, parts: RunParts) -> float:
    return parts.scoring.ledger.rows.series()[series]


def signal_variables(signals: Mapping[str, Signal]) -> dict[str, Variable]:
    """Turn signals into variables of shape (1,)."""
    return variable_table(
        Variable(
            signal.name,
            signal.unit,
            (1,),
            Causality.INPUT if signal.is_input else Causality.OUTPUT,
            limits=signal.limits,
        )
        for signal in signals.values()
    )


class SignalBoard(Participant):
    """Reads outputs from the parts of a run as they are and puts inputs into effect at once; keeps the contract of a participant.

    A run has two: `ORDER_BOARD` takes what FMUs drive, before the parts step; `READING_BOARD` gives what feeds them, after.

    An input that is never set leaves the run to the scenario and its orders; one that has been set rules from then on.
    """

    STATE = ()

    def __init__(self, name: str, signals: Mapping[str, Signal], parts: RunParts) -> None:
        super().__init__(name, signal_variables(signals).values())
        self._signals = dict(signals)
        self._parts = parts
        self._given: dict[str, float] = {}

    def get(self, name: str) -> Array:
        """Return a signal (1,) in its unit, for an input the value last set; ValueError for an output that is not known."""
        signal = self._signals.get(name)
        if signal is None:
            raise ValueError(f"the run has no signal {name!r}, allowed: {', '.join(self._signals)}")
        return np.array([self._given.get(name, signal.start) if signal.read is None else signal.read(self._parts)])

    def set(self, name: str, value: Array) -> None:
        """Set an input (1,) in its unit; ValueError for a number beyond the limits of its key in a scenario file."""
        number = float(checked_value(self.name, self.variables, name, value)[0])
        self._parts.drive({name: number})
        self._given[name] = number

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Do nothing: inputs are in effect already."""
        return StepResult(Status.OK, time + step_size)

    def save_state(self) -> object:
        """Return the values of the inputs that have been set."""
        return dict(self._given)

    def restore_state(self, state: object) -> None:
        """Go back to a state that `save_state` returned; ValueError for a number beyond its limits."""
        given = {
            name: float(checked_value(self.name, self.variables, name, [value])[0])
            for name, value in cast(dict[str, float], state).items()
        }
        self._parts.drive(dict.fromkeys(self._given) | given)
        self._given = given
