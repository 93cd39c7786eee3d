"""The scores of a boom: its oil, how fast and how hard it was towed, and when it first leaked. Nothing else computes them again."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from booms.boom_state import BoomState, beside, signed_distance
from booms.containment import PRACTICE_SPEED, Containment, ContainmentOptions
from booms.deployment import BoomLayout
from booms.losses.closure_losses import ClosureLosses
from booms.scores import HeldSpeed, LossSpeeds, TensionRecord
from coupling.bullet.rigid_body_world import RigidBodyWorld
from oilsim import Fluid
from oilsim.backend.arrays import Array, Flags, Index
from oilsim.core.physical_constants import KNOT
from oilsim.oil.ledger import BoomOil, OilLedger
from recordings.model.frame import EventLevel
from recordings.model.words import LEADING, cause_in_words
from recordings.replay.series import WORST
from scenarios.schema.exercise import BoomSettings, body_of
from scenarios.schema.liquid import Tank
from scenarios.schema.sea import SeaSettings
from scenarios.setup.afloat.boom_lines import track_off_reel
from scenarios.spec.resolve import RunSpec
from scenarios.watch.slick_oil import oil_of_boom, volume_ahead, volume_within

if TYPE_CHECKING:
    from coupling.participants.slick import SlickParticipant


# [s] below its limit, beside the held speed's window, after which a rise of that speed is told anew; chosen: not in each wave
RESTED = 5.0
# [1] windows of the held speed above its limit from which on it is no swing; chosen by the start-up swings of booms
LASTS = 3.0


@dataclass(frozen=True)
class Notice:
    """Text worth a line in the log, how serious it is, and who says it."""

    text: str
    level: EventLevel
    source: str


class Oil(NamedTuple):
    """The oil of a run: particles at position (N, 3) [m] with ids (N,), or one slick; and what skimmers at the boom took of it [m3]."""

    position: Array
    ids: Index
    slicks: Sequence[SlickParticipant] = ()
    recovered: float = 0.0


class BoomScore:
    """Keeps one boom's scores from communication point to communication point; only `advance` changes them.

    values: the scores at the last communication point by the names of their series, empty before the first; held (S,) [m/s]: the speed that
    is held now against each segment.
    """

    def __init__(
        self,
        name: str,
        settings: BoomSettings,
        layout: BoomLayout,
        tensions: Mapping[str, str],
        liquid: RunSpec,
        sea: SeaSettings,
        closures: ClosureLosses | None,
        ledger: OilLedger,
    ) -> None:
        """Prepare the scores; `tensions` has, for each end, the joint that carries the tow tension; closures None: there are none."""
        self.name, self.segments = name, [segment.name for segment in layout.segments]
        self.values: dict[str, float] = {}
        self.held = np.zeros(len(layout.segments))
        self.closures, self._ledger = closures, ledger
        self._layout, self._track = layout, track_off_reel(layout, settings)
        self._tension_joints = dict(tensions)
        self._tensions = {end: TensionRecord() for end in tensions}
        self._losses = LossSpeeds()
        waves = sea.height_and_period[1]
        self._held = HeldSpeed.at(PRACTICE_SPEED, settings.skirt_depth, waves)
        self._towed = HeldSpeed(window=waves) if waves else None  # vessels swing in waves, too
        self._area = np.array(settings.area)
        self._sweeps, self._leads = settings.kind == "sweep", settings.kind in LEADING
        self._vessels = [body_of(end) for end in settings.ends if isinstance(end, str)]
        self._time: float | None = None
        self.strength_share: float | None = None  # [-] largest along the boom now; None without a strength
        self._berth = settings.berth
        self._has_tide = sea.tide is not None
        self._fast, self._crossed = False, 0.0  # whether that speed is above its limit, and since when [s]
        self._worst: dict[str, float] = {}
        self._told: set[str] = set()
        self._notices: list[Notice] = []
        spacing = liquid.spacing
        self._tanks, self._slack, self._volume = (liquid.domain,) if liquid.in_tank else (), spacing, spacing**3
        self._period = liquid.domain.period
        self._ended = False  # once the boom has left the simulated sea
        self.containment = Containment(_options(settings, liquid))

    @property
    def oil(self) -> BoomOil:
        """The boom's oil, as the ledger has it."""
        return self._ledger.booms.get(self.name, BoomOil())

    def advance(self, time: float, world: RigidBodyWorld, oil: Oil, level: float, current: Array) -> None:
        """Take the state at `time` [s] into the scores, which end once the boom or a vessel of it has left the simulated sea.

        level [m] of the still water; current (3,) [m/s].
        """
        state = self._state(world)
        self._look_out(world, state)
        if self._ended:
            return
        afloat = self._is_afloat(state)
        out = state if afloat.all() else state.part(afloat)
        found = self._ledger.enter(self.name, self._found(time, out, oil, level, current))
        self.held = self._held.add(time, afloat * state.normal_flow(current))
        held, step = float(self.held.max()), 0.0 if self._time is None else time - self._time
        self._time = time
        speed = self._tow_speed(time, world, current)
        led_on = found.lost.get("around_ends", 0.0) if self._leads else 0.0
        self._losses.add(time, speed, found.passed - led_on, found.met, self._parcel(oil))
        values = found.series() | self._shape(out, level, current) | {"tow_speed": speed, "normal_speed_held": held}
        values |= {"normal_speed_limit": PRACTICE_SPEED}
        values |= self._optional_series(oil, state.line(), level)
        values |= {f"current/{axis}": float(current[place]) for place, axis in enumerate("xy")}
        values |= {
            "first_loss_speed": self._losses.first_loss or 0.0,
            "gross_loss_speed": self._losses.gross_loss or 0.0,
        }
        self.values = values | self._pull(world, step) | self._remember(values)
        self._announce_speed(time, held)
        self._announce(found, speed)

    def _found(self, time: float, out: BoomState, oil: Oil, level: float, current: Array) -> BoomOil:
        """Return the oil of the boom, of which `out` is afloat, as its carrier tells it; other arguments as of `advance`."""
        for slick in oil.slicks:  # particles of a window are parcels of the slick, and lie in a box of their own
            return replace(oil_of_boom(slick, self.name), recovered=oil.recovered)
        flow = (float(current[0]), float(current[1]))
        return self.containment.update(time, out, oil.position, oil.ids, water_level=level, current=flow)

    def _shape(self, out: BoomState, level: float, current: Array) -> dict[str, float]:
        """Return the figures that tell of the boom, not of the oil."""
        foot = out.heights(self.containment.options.freeboard, self.containment.options.skirt_depth)[1]
        return {
            "gap_ratio": out.gap_ratio,
            "normal_speed": float(out.normal_speed(current).max()),
            "effective_draft": float((level - foot).min()),
            "skirt_angle": float(out.skirt_angle().max()),
        }

    def _optional_series(self, oil: Oil, line: Array, level: float) -> dict[str, float]:
        """Return the series that only some booms have; oil and level [m] as for `advance`, line (S + 1, 2) [m] of the boom."""
        series: dict[str, float] = {}
        if self.closures is not None:
            series["closure_loss_rate"] = self.closures.rate
        if self._sweeps:
            series["oil_ahead"] = volume_ahead(oil[:3], line, self.containment)
        if len(self._area):
            series["oil_in_area"] = self._volume_in_area(oil)
        if self.strength_share is not None:
            series["strength_share"] = self.strength_share
        if self._berth is not None:
            series["to_berth"] = float(np.linalg.norm(line[-1] - self._berth))
        if self._has_tide:
            series["water_level"] = level
        return series

    def _parcel(self, oil: Oil) -> float:
        """Return the volume [m3] of the largest parcel or particle."""
        volumes = [float(one.slick.parcels.volume.max(initial=0.0)) for one in oil.slicks]
        return max(volumes, default=self._volume)

    def _volume_in_area(self, oil: Oil) -> float:
        """Return the volume [m3] of oil in the protected area."""
        for slick in oil.slicks:
            return volume_within(slick, self._area)
        within = beside(oil.position, self._area, self._period)[:, :2]
        return float((signed_distance(within, self._area)[0] > 0.0).sum()) * self._volume

    def lose(self, time: float, fluid: Fluid, world: RigidBodyWorld, level: float) -> None:
        """Let the closures carry out what is due at `time` [s], before the scores take the state in; level [m] of the still water."""
        if self.closures is not None:
            self.closures.act(time, fluid, self.containment, self._state(world), level)

    def take_parting(self, number: int, why: str = "") -> None:
        """Announce that a joint, counted from 1 at the first end, has parted, and why."""
        between = f"has parted at joint {number}, between segments {number - 1} and {number}"
        between += f" ({why})" if why else ""
        meaning = "oil that passes the opening counts as lost through a joint"
        self._tell_once(f"parted {number}", True, f"{between}; {meaning}")

    def series(self) -> dict[str, float]:
        """Return the scores at the last communication point, by the names of their series; empty before the first, and after the end."""
        return {} if self._ended else {f"metrics/{name}": value for name, value in self.values.items()}

    def _look_out(self, world: RigidBodyWorld, state: BoomState) -> None:
        """Say where the boom or one of its vessels leaves the simulated sea, and where it sails on into a sea that repeats."""
        places = np.concatenate([state.line(), *(world.pose(name)[None, :2] for name in self._vessels)])
        passed = (one for tank in self._tanks for one in _sides_passed(tank, places, self._slack))
        for side, text, ends in passed:
            self._tell_once(f"edge {side}", True, text)
            self._ended |= ends

    def take_notices(self) -> list[Notice]:
        """Return and forget the notices since the last call."""
        notices, self._notices = self._notices, []
        return notices

    def _announce_speed(self, time: float, held: float) -> None:
        """Announce that the `held` speed [m/s] stays above its limit, and anew after a rest below it; a swing alone is not told."""
        fast = held > PRACTICE_SPEED
        if fast != self._fast:
            self._fast, self._crossed = fast, time
        for_long, rested = LASTS * self._held.window, RESTED + self._held.window
        lasts = time - self._crossed
        text = f"water has run against the boom at more than 0.7 kn (normal to it) for {for_long:.2g} s"
        self._tell_once("too fast", fast and lasts >= for_long, text)
        if not fast and lasts >= rested:
            self._told.discard("too fast")

    def _announce(self, oil: BoomOil, speed: float) -> None:
        """Announce what happens for the first time; tow's `speed` [m/s]."""
        through = f"at {speed / KNOT:.2f} kn through the water"
        share = 100.0 * self._losses.first_share
        first, gross = self._losses.first_loss, self._losses.gross_loss
        for cause, volume in oil.lost.items():
            if self._leads and cause == "around_ends":
                self._tell_once("leads", volume > 0.0, "leads oil on past its end", "info")
                continue
            modelled, words = oil.lost_modelled[cause], cause_in_words(cause)
            begun = self._losses.begun
            self._tell_once(cause, begun and volume > modelled, f"first oil {words} (resolved), {through}")
            self._tell_once(f"modelled {cause}", begun and modelled > 0.0, f"first oil {words} (modelled), {through}")
        if first is not None:
            self._tell_once("first loss", True, f"has lost more than {share:g} % of its oil, at {first / KNOT:.2f} kn")
        if gross is not None:
            rate, window = 60.0 * 100.0 * self._losses.gross_rate, self._losses.gross_window
            text = f"has lost more than {rate:g} % of its oil a minute for {window:g} s, at {gross / KNOT:.2f} kn"
            self._tell_once("gross loss", True, text)

    def _tell_once(self, key: str, happens: bool, text: str, level: EventLevel = "warning") -> None:
        if happens and key not in self._told:
            self._told.add(key)
            self._notices.append(Notice(text, level=level, source=f"boom {self.name}"))

    def _state(self, world: RigidBodyWorld) -> BoomState:
        names = self.segments
        poses = world.poses(names)
        return BoomState(
            position=poses[:, :3],
            orientation=poses[:, 3:],
            velocity=world.twists(names)[:, :3],
            joint_points=self._layout.segment.joint_points,
            waterline=self._layout.segment.waterline,
            flow_share=self._layout.boom.flow_shares,
        )

    def _is_afloat(self, state: BoomState) -> Flags:
        """Tell which segments (S,) are off their reel; the outermost one always counts."""
        afloat = np.ones(len(state.position), np.bool_)
        if self._track is not None:
            afloat[:-1] = ~self._track.is_wound(state.position)[:-1]
        return afloat

    def _tow_speed(self, time: float, world: RigidBodyWorld, current: Array) -> float:
        """Compute the mean speed [m/s] of the towing vessels through the water; in waves the mean over a wave's period."""
        if not self._vessels:
            return float(np.linalg.norm(current[:2]))
        relative = np.array([world.twist(name)[:2] - current[:2] for name in self._vessels])
        if self._towed is not None:
            relative = self._towed.add(time, relative)
        return float(np.linalg.norm(relative, axis=1).mean())

    def _pull(self, world: RigidBodyWorld, duration: float) -> dict[str, float]:
        """Return the tow tension [N] at each end, which acted for `duration` [s], and its peak."""
        scalars: dict[str, float] = {}
        for end, joint in self._tension_joints.items():
            tension, record = world.tension(joint), self._tensions[end]
            record.add(tension, duration)
            scalars |= {f"tow_tension/{end}": tension, f"{WORST}tow_tension/{end}": record.peak}
        return scalars

    def _remember(self, values: Mapping[str, float]) -> dict[str, float]:
        """Keep the extreme values of the summary's scores for recordings, which do not hold every communication point."""
        for key in ("normal_speed_held", "skirt_angle", "strength_share"):
            if key in values:
                self._worst[key] = max(self._worst.get(key, 0.0), values[key])
        draft = values["effective_draft"]
        self._worst["effective_draft"] = min(self._worst.get("effective_draft", draft), draft)
        return {f"{WORST}{key}": value for key, value in self._worst.items()}

    def save_state(self) -> dict[str, Any]:
        """Return the scores as they stand, as plain data."""
        return {
            "containment": self.containment.save_state(),
            "closures": None if self.closures is None else self.closures.save_state(),
            "values": dict(self.values),
            "held_now": self.held.copy(),
            "tensions": {end: asdict(record) for end, record in self._tensions.items()},
            "losses": asdict(self._losses),
            "held": asdict(self._held),
            "towed": None if self._towed is None else asdict(self._towed),
            "time": self._time,
            "worst": dict(self._worst),
            "told": sorted(self._told),
            "fast": (self._fast, self._crossed),
            "ended": self._ended,
        }

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to what `save_state` returned."""
        self.values, self.held = dict(saved["values"]), saved["held_now"].copy()
        self.containment.restore_state(saved["containment"])
        if self.closures is not None:
            self.closures.restore_state(saved["closures"])
        self._tensions = {end: TensionRecord(**record) for end, record in saved["tensions"].items()}
        self._losses, self._held = LossSpeeds(**deepcopy(saved["losses"])), HeldSpeed(**deepcopy(saved["held"]))
        self._towed = None if saved["towed"] is None else HeldSpeed(**deepcopy(saved["towed"]))
        self._time, self._worst = saved["time"], dict(saved["worst"])
        self._told, self._notices = set(saved["told"]), []
        self._fast, self._crossed = saved["fast"]
        self._ended = saved["ended"]

    def summary(self) -> dict[str, Any]:
        """Return the boom's scores; speeds are in knots and angles in degrees if the key says so."""
        oil, values = self.oil, self.values
        if not values:
            return {}
        return {
            "contained_share": oil.contained_share,
            "gap_ratio": values["gap_ratio"],
            "largest_held_normal_speed_kn": values[f"{WORST}normal_speed_held"] / KNOT,
            "largest_skirt_angle_deg": float(np.degrees(values[f"{WORST}skirt_angle"])),
            "smallest_effective_draft_m": values[f"{WORST}effective_draft"],
            "first_loss_speed_kn": _knots(self._losses.first_loss),
            "gross_loss_speed_kn": _knots(self._losses.gross_loss),
            "met_m3": oil.met,
            "passed_m3": oil.passed,
            "recontained_m3": oil.recontained,
            "lost_modelled_share": oil.all_lost_modelled / oil.all_lost if oil.all_lost > 0.0 else None,
            "oil_in_area_m3": values.get("oil_in_area"),
            "tow_tension_n": {end: {"mean": t.mean, "peak": t.peak} for end, t in self._tensions.items()},
        }


def _sides_passed(tank: Tank, places: Array, slack: float) -> Iterator[tuple[str, str, bool]]:
    """Yield each side that some of the places (N, 2) [m] are beyond, what that means in words, and whether it ends the scoring.

    Places up to `slack` [m] beyond a side do not count: an end that is made fast there swings a little.
    """
    for place, axis, low, high in zip(places.T, "xy", tank.lower, tank.upper, strict=False):
        for side, way in ((f"-{axis}", low - place.min()), (f"+{axis}", place.max() - high)):
            if way > slack and axis in tank.periodic:
                text = f"sails past side {side} of the sea, which repeats every {high - low:g} m"
                yield side, f"{text}: from here on it may meet its own wake and oil that it has lost", False
            elif way > slack and side in tank.open:
                yield side, f"has left the simulated sea through its open side {side}: its scoring ends here", True


def _options(settings: BoomSettings, liquid: RunSpec) -> ContainmentOptions:
    """Return what tells a boom's oil; of several oils the viscosity is that of the most viscous."""
    spacing = liquid.spacing
    oils = [phase for phase in liquid.phases.values() if phase.is_oil]
    return ContainmentOptions(
        skirt_depth=settings.skirt_depth,
        freeboard=settings.freeboard,
        particle_volume=spacing**3,
        hysteresis=spacing,
        kinematic_viscosity=max((oil.viscosity / oil.rest_density for oil in oils), default=0.0),
        period=liquid.domain.period,
    )


def _knots(speed: float | None) -> float | None:
    return None if speed is None else speed / KNOT
