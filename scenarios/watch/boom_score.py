"""The scores of a boom exercise: where the oil is, how fast and how hard the boom was towed, and when it first leaked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from booms.boom_state import BoomState, beside, signed_distance
from booms.containment import PRACTICE_SPEED, ContainmentOptions, ContainmentReport, ContainmentTracker
from booms.deployment import BoomLayout
from booms.losses.closure_losses import INTERVAL, ClosureLosses
from booms.scores import HeldSpeed, LossSpeeds, TensionRecord
from coupling.bullet.rigid_body_world import RigidBodyWorld
from oilsim import Fluid
from oilsim.core.physical_constants import KNOT
from oilsim.slick.loss_cause import CAUSES
from recordings.model.frame import EventLevel
from recordings.model.words import cause_in_words
from recordings.replay.running_extremes import WORST
from scenarios.scenario import Scenario
from scenarios.schema.exercise import body_of
from scenarios.setup.boom_lines import track_off_reel
from scenarios.watch.sea_at_booms import sides_passed
from scenarios.watch.slick_account import volume_within, with_slick

if TYPE_CHECKING:
    from coupling.participants.slick import SlickParticipant

Array = NDArray[np.float64]

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


class Beside(NamedTuple):
    """Oil that is no particles: the slick, None in a run without one, and the oil [m3] that skimmers at the boom have taken of it."""

    slick: SlickParticipant | None = None
    skimmed: float = 0.0


class BoomScore:
    """Keeps one boom's account from communication point to communication point; only `advance` changes it."""

    def __init__(
        self,
        name: str,
        scenario: Scenario,
        layout: BoomLayout,
        tensions: Mapping[str, str],
        closures: ClosureLosses | None = None,
    ) -> None:
        """Prepare the account; `tensions` has, for each end, the joint that carries the tow tension; closures None: there are none."""
        settings = scenario.booms[name]
        self.name = name
        self.report: ContainmentReport | None = None
        self.closures = closures
        self._layout, self._track = layout, track_off_reel(layout, settings)
        self._tension_joints = dict(tensions)
        self._tensions = {end: TensionRecord() for end in tensions}
        self._losses = LossSpeeds()
        waves = scenario.sea.height_and_period[1]
        self._held = HeldSpeed.at(PRACTICE_SPEED, settings.skirt_depth, waves)
        self._towed = HeldSpeed(window=waves) if waves else None  # vessels swing in waves, too
        self._area = np.array(settings.area)
        self._oil_in_area: float | None = None  # [m3]
        self._held_back = 0.0  # [m3]
        self._met = 0.0  # [m3] of oil, also what floated off again or was skimmed
        self._vessels = [body_of(end) for end in settings.ends if isinstance(end, str)]
        self._time: float | None = None
        self.strength_share: float | None = None  # [-] largest along the boom now; None without a strength
        self._berth = settings.berth
        self._has_tide = scenario.sea.tide is not None
        self.held_speed = 0.0  # [m/s] largest along the boom that is held now
        self._fast, self._crossed = False, 0.0  # whether that speed is above its limit, and since when [s]
        self._worst: dict[str, float] = {}
        self._told: set[str] = set()
        self._notices: list[Notice] = []
        self._series: dict[str, float] = {}
        spacing = scenario.fluid.particle_spacing
        self._tank, self._slack, self._volume = scenario.tank, spacing, spacing**3
        self._period = scenario.period
        self._ended = False  # once the boom has left the simulated sea
        self.tracker = ContainmentTracker(_options(name, scenario))

    def advance(
        self,
        time: float,
        world: RigidBodyWorld,
        oil: tuple[Array, NDArray[np.uint32]],
        level: float,
        current: Array,
        beside: Beside,
    ) -> None:
        """Take the state at `time` [s] into the account, which ends once the boom or a vessel of it has left the simulated sea.

        oil: positions (N, 3) [m] and ids (N,); level [m] of the still water; current (3,) [m/s].
        """
        slick = beside.slick
        state = self._state(world)
        self._look_out(world, state)
        if self._ended:
            self._series = {}
            return
        flow = (float(current[0]), float(current[1]))
        afloat = self._is_afloat(state)
        out = state if afloat.all() else state.part(afloat)
        if slick is None:
            report = self.tracker.update(time, out, *oil, water_level=level, current=flow)
        else:  # particles of a window are parcels of the slick, and lie in a box of their own
            report = self.tracker.update_without_particles(time, out, water_level=level, current=flow)
            report = with_slick(report, slick, self.name)
        report = self._looked_at(time, report)
        self.report = report
        self.held_speed = held = float(self._held.add(time, afloat * state.normal_flow(current)).max())
        step = 0.0 if self._time is None else time - self._time
        self._time = time
        speed = self._tow_speed(time, world, current)
        series = report.scalars() | {"metrics/tow_speed": speed}
        series |= {"metrics/normal_speed_held": held, "metrics/normal_speed_limit": PRACTICE_SPEED}
        self._held_back = self._put_back(slick)
        series |= self._optional_series(oil, slick, state.line(), level)
        series |= {f"metrics/current/{axis}": float(current[place]) for place, axis in enumerate("xy")}
        self._series = series | self._pull(world, step) | self._remember(report, held)
        there = report.retained + report.lost
        self._met = max(self._met, there + (beside.skimmed if self._met > 0.0 or there > 0.0 else 0.0))
        self._losses.add(time, speed, report.passed, self._met)
        self._announce_speed(time, held)
        self._announce(report, speed)

    def _looked_at(self, time: float, report: ContainmentReport) -> ContainmentReport:
        """Return the report at `time` [s], with oil that slipped past still held until the closures look, which may put it back."""
        resolved = report.lost - math.fsum(report.lost_modelled.values())
        if self.closures is None or not self.closures.puts_back or resolved < 0.5 * self._volume:
            return report
        standing = self.tracker.standing()
        fresh = ~standing.retained & ~standing.modelled & (time - standing.lost_at <= INTERVAL)
        number = np.bincount(standing.cause[fresh], minlength=len(CAUSES))
        counts = zip(CAUSES, number.tolist(), strict=True)
        lost = {cause: self._less(report.lost_by_cause[cause], count) for cause, count in counts}
        whole = self._less(report.lost, int(number.sum()))
        return replace(report, lost=whole, lost_by_cause=lost, retained=self._less(report.retained, -int(number.sum())))

    def _less(self, volume: float, count: int) -> float:
        """Return a volume [m3] of whole particles less a `count` of them, without round-off."""
        return (round(volume / self._volume) - count) * self._volume

    def _optional_series(
        self, oil: tuple[Array, NDArray[np.uint32]], slick: SlickParticipant | None, line: Array, level: float
    ) -> dict[str, float]:
        """Return the series that only some booms have; oil, slick and level [m] as for `advance`, line (S + 1, 2) [m] of the boom."""
        series: dict[str, float] = {}
        if self.closures is not None:
            series["metrics/closure_loss_rate"] = self.closures.rate
        if self.closures is not None or self._held_back > 0.0:
            series["metrics/oil_held_back"] = self._held_back
        if len(self._area):
            self._oil_in_area = self._volume_in_area(oil[0], slick)
            series["metrics/oil_in_area"] = self._oil_in_area
        if self.strength_share is not None:
            series["metrics/strength_share"] = self.strength_share
        if self._berth is not None:
            series["metrics/to_berth"] = float(np.linalg.norm(line[-1] - self._berth))
        if self._has_tide:
            series["metrics/water_level"] = level
        return series

    def _volume_in_area(self, oil: Array, slick: SlickParticipant | None) -> float:
        """Return the volume [m3] of oil in the protected area: of particles at `oil` (N, 3) [m], or of a slick."""
        if slick is not None:
            return volume_within(slick, self._area)
        within = beside(oil, self._area, self._period)[:, :2]
        return float((signed_distance(within, self._area)[0] > 0.0).sum()) * self._volume

    def lose(self, time: float, fluid: Fluid, world: RigidBodyWorld, level: float) -> None:
        """Let the closures carry out what is due at `time` [s], before the account takes the state in; level [m] of the still water."""
        if self.closures is not None:
            self.closures.act(time, fluid, self.tracker, self._state(world), level)

    def take_parting(self, number: int, why: str = "") -> None:
        """Announce that a joint, counted from 1 at the first end, has parted, and why."""
        between = f"has parted at joint {number}, between segments {number - 1} and {number}"
        between += f" ({why})" if why else ""
        meaning = "oil that passes the opening counts as lost through a joint"
        self._tell_once(f"parted {number}", True, f"{between}; {meaning}")

    def series(self) -> dict[str, float]:
        """Return the scores at the last communication point, by the names of their series; empty before the first, and after the end."""
        return dict(self._series)

    def _look_out(self, world: RigidBodyWorld, state: BoomState) -> None:
        """Say where the boom or one of its vessels leaves the simulated sea, and where it sails on into a sea that repeats."""
        places = np.concatenate([state.line(), *(world.pose(name)[None, :2] for name in self._vessels)])
        for side, text, ends in sides_passed(self._tank, places, self._slack, repeats=any(self._period)):
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

    def _announce(self, report: ContainmentReport, speed: float) -> None:
        """Announce what happens for the first time; tow's `speed` [m/s]."""
        through = f"at {speed / KNOT:.2f} kn through the water"
        share = 100.0 * self._losses.first_share
        first, gross = self._losses.first_loss, self._losses.gross_loss
        for cause, volume in report.lost_by_cause.items():
            modelled, words = report.lost_modelled.get(cause, 0.0), cause_in_words(cause)
            begun = self._losses.begun
            self._tell_once(cause, begun and volume > modelled, f"first oil {words} (resolved), {through}")
            self._tell_once(f"modelled {cause}", begun and modelled > 0.0, f"first oil {words} (modelled), {through}")
        back = "its skirt is too few particles deep to hold oil as a real one does: oil that slips under it is put back (modelled)"
        self._tell_once("held back", self._held_back > 0.0, back)
        if first is not None:
            self._tell_once("first loss", True, f"has lost more than {share:g} % of its oil, at {first / KNOT:.2f} kn")
        if gross is not None:
            rate, window = 60.0 * 100.0 * self._losses.gross_rate, self._losses.gross_window
            text = f"has lost more than {rate:g} % of its oil a minute for {window:g} s, at {gross / KNOT:.2f} kn"
            self._tell_once("gross loss", True, text)
        self._take_back("first loss", first)
        self._take_back("gross loss", gross)

    def _take_back(self, loss: str, speed: float | None) -> None:
        """Say that a loss that was told does not count any more."""
        if speed is None and loss in self._told:
            self._told.remove(loss)
            text = f"has taken back what it had lost: its {loss} does not count"
            self._notices.append(Notice(text, level="info", source=f"boom {self.name}"))

    def _put_back(self, slick: SlickParticipant | None) -> float:
        """Return the oil [m3] that particles let slip under the skirt and that was put back, since the start."""
        if slick is not None:
            return float(slick.get(f"{self.name}.held_back"))
        return 0.0 if self.closures is None else self.closures.held_back

    def _tell_once(self, key: str, happens: bool, text: str) -> None:
        if happens and key not in self._told:
            self._told.add(key)
            self._notices.append(Notice(text, level="warning", source=f"boom {self.name}"))

    def _state(self, world: RigidBodyWorld) -> BoomState:
        names = [segment.name for segment in self._layout.segments]
        poses = world.poses(names)
        return BoomState(
            position=poses[:, :3],
            orientation=poses[:, 3:],
            velocity=world.twists(names)[:, :3],
            joint_points=self._layout.segment.joint_points,
            waterline=self._layout.segment.waterline,
            flow_share=self._layout.boom.flow_shares,
        )

    def _is_afloat(self, state: BoomState) -> NDArray[np.bool_]:
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
            scalars |= {f"metrics/tow_tension/{end}": tension, f"metrics/{WORST}tow_tension/{end}": record.peak}
        return scalars

    def _remember(self, report: ContainmentReport, held: float) -> dict[str, float]:
        """Keep the extreme values of the summary's scores for recordings, which do not hold every communication point."""
        for key, value in (("normal_speed_held", held), ("skirt_angle", report.skirt_angle)):
            self._worst[key] = max(self._worst.get(key, 0.0), value)
        if self.strength_share is not None:
            self._worst["strength_share"] = max(self._worst.get("strength_share", 0.0), self.strength_share)
        draft = report.effective_draft
        self._worst["effective_draft"] = min(self._worst.get("effective_draft", draft), draft)
        return {f"metrics/{WORST}{key}": value for key, value in self._worst.items()}

    def first_loss_speed(self) -> float | None:
        """Return the tow speed [m/s] at the first loss; None before it."""
        return self._losses.first_loss

    def gross_loss_speed(self) -> float | None:
        """Return the tow speed [m/s] at the gross loss; None before it."""
        return self._losses.gross_loss

    @property
    def retained_share(self) -> float | None:
        """Share [-] of all oil that the boom has met that it has not lost, without round-off; None before it has met any."""
        return round(1.0 - self.report.lost / self._met, 12) if self.report is not None and self._met > 0.0 else None

    def save_state(self) -> dict[str, Any]:
        """Return the account as it stands, as plain data."""
        return {
            "tracker": self.tracker.save_state(),
            "closures": None if self.closures is None else self.closures.save_state(),
            "report": None if self.report is None else asdict(self.report),
            "tensions": {end: asdict(record) for end, record in self._tensions.items()},
            "losses": asdict(self._losses),
            "held": asdict(self._held),
            "towed": None if self._towed is None else asdict(self._towed),
            "time": self._time,
            "worst": dict(self._worst),
            "told": sorted(self._told),
            "fast": (self._fast, self._crossed),
            "ended": self._ended,
            "oil_in_area": self._oil_in_area,
            "held_back": self._held_back,
            "met": self._met,
        }

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to what `save_state` returned; `series` is empty until the next communication point."""
        self._series = {}
        self.tracker.restore_state(saved["tracker"])
        if self.closures is not None:
            self.closures.restore_state(saved["closures"])
        self.report = None if saved["report"] is None else ContainmentReport(**saved["report"])
        self._tensions = {end: TensionRecord(**record) for end, record in saved["tensions"].items()}
        self._losses, self._held = LossSpeeds(**deepcopy(saved["losses"])), HeldSpeed(**deepcopy(saved["held"]))
        self._towed = None if saved["towed"] is None else HeldSpeed(**deepcopy(saved["towed"]))
        self._time, self._worst = saved["time"], dict(saved["worst"])
        self._told, self._notices = set(saved["told"]), []
        self._fast, self._crossed = saved["fast"]
        self._ended, self._oil_in_area = saved["ended"], saved["oil_in_area"]
        self._held_back, self._met = saved["held_back"], saved["met"]

    def summary(self) -> dict[str, Any]:
        """Return the boom's scores; speeds are in knots and angles in degrees if the key says so."""
        report = self.report
        if report is None:
            return {}
        return {
            "retained_share": self.retained_share,
            "gap_ratio": report.gap_ratio,
            "largest_held_normal_speed_kn": self._worst["normal_speed_held"] / KNOT,
            "largest_skirt_angle_deg": float(np.degrees(self._worst["skirt_angle"])),
            "smallest_effective_draft_m": self._worst["effective_draft"],
            "first_loss_speed_kn": _knots(self._losses.first_loss),
            "gross_loss_speed_kn": _knots(self._losses.gross_loss),
            "passed_m3": report.passed,
            "taken_back_m3": report.recovered,
            "lost_modelled_share": sum(report.lost_modelled.values()) / report.lost if report.lost > 0.0 else None,
            "held_back_m3": self._held_back,
            "oil_in_area_m3": self._oil_in_area,
            "tow_tension_n": {end: {"mean": t.mean, "peak": t.peak} for end, t in self._tensions.items()},
        }


def _options(name: str, scenario: Scenario) -> ContainmentOptions:
    """Return what a tracker of a boom's oil has to know; of several oils the most viscous."""
    settings, spacing = scenario.booms[name], scenario.fluid.particle_spacing
    oils = [phase for phase in scenario.phases.values() if phase.is_oil]
    return ContainmentOptions(
        skirt_depth=settings.skirt_depth,
        freeboard=settings.freeboard,
        particle_volume=spacing**3,
        hysteresis=spacing,
        kinematic_viscosity=max((oil.viscosity / oil.rest_density for oil in oils), default=0.0),
        period=scenario.period,
    )


def _knots(speed: float | None) -> float | None:
    return None if speed is None else speed / KNOT
