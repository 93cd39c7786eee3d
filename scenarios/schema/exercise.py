"""Vessels, booms and their orders: the response exercise of a scenario.

Headings are counter-clockwise about z from +x. Booms and vessels float at the level of the water in the tank.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass
from itertools import pairwise
from types import MappingProxyType
from typing import Any, ClassVar, Literal

from booms.boom import BoomDesign, Pocket
from booms.boom import catalogue as boom_catalogue
from oilsim.core.quantity import quantity, quantity_of
from scenarios.schema.bodies import crosses_itself
from scenarios.schema.criteria import Deployment
from scenarios.schema.parsing.quantity_fields import CatalogueSection, Point2, Section
from scenarios.schema.parsing.relations import Relation, above, at_most_one, exactly_one, only_with, reference, together
from scenarios.text.problems import Problem
from vessels.course import CourseLeg
from vessels.drive import Drive
from vessels.hull_size import HullSize
from vessels.hull_size import catalogue as vessel_catalogue
from vessels.vessel import ControlGains, Propulsion

LONGEST_LINE = 2000.0  # [m] of a line or what a winch brings in or out; user; as of a part of a mooring leg
MACHINERY = "thrust_order side_thrust_order yaw_moment_order"


def body_of(vessel: str) -> str:
    """Return the name of a vessel's body."""
    return f"vessels/{vessel}"


def segment_names(boom: str, count: int) -> tuple[str, ...]:
    """Return the names of the bodies of a boom's segments, from its first end to its second."""
    return tuple(f"boom/{boom}/segment-{index:02d}" for index in range(count))


def joint_name(boom: str, number: int) -> str:
    """Return the name of a joint of a boom, counted from 1 at its first end."""
    return f"boom/{boom}/joint-{number:02d}"


@dataclass(frozen=True, kw_only=True)
class LegSettings(Section):
    """Orders from `start` [s] until the next leg: speed [m/s] over the ground, and heading [rad].

    through  a point (x, y) [m] of the line to keep to; without it, the vessel keeps only its heading
    by_hand  thrust ahead and steering counter-clockwise, each from -1 to 1 of the largest; then speed, heading and line are not kept
    """

    COMPASS: ClassVar[str | None] = "heading_compass"
    start: float = quantity_of(CourseLeg, "start_time", default=0.0)
    speed: float = quantity_of(CourseLeg, "speed")
    heading: float = quantity_of(CourseLeg, "heading")
    through: Point2 | None = quantity_of(CourseLeg, "through")
    by_hand: Point2 | None = quantity_of(CourseLeg, "by_hand")


@dataclass(frozen=True, kw_only=True)
class TowSettings(Section):
    """Orders to all vessels that have no orders of their own: abreast along one heading, each on its own line.

    speed    [m/s] over the ground
    heading  [rad]
    start    [s] at which the vessels get under way; before, they keep their places
    """

    COMPASS: ClassVar[str | None] = "heading_compass"
    speed: float = quantity("m/s", at_least=0.0, at_most=20.0)
    heading: float = quantity("rad")
    start: float = quantity("s", default=0.0, at_least=0.0)


@dataclass(frozen=True, kw_only=True)
class VesselSettings(CatalogueSection, HullSize):
    """A vessel that floats at its draft, with thrust and steering under orders.

    vessel        name of a vessel of the catalogue (`oilsim vessels`), which gives length, beam, draft, depth and bollard_pull where they
                  are not stated here; without it, they must be
    length, beam, draft, depth  [m] of the hull
    shape         "wigley" (the lines of a ship) or "barge" (raked ends)
    position      [m] (x, y) of midships at the start
    heading       [rad] at the start
    control       "helmsman" follows orders of speed and heading; with "manual", a connected FMU, or the program that runs an exported FMU,
                  gives thrust and steering, which are 0 until then
    legs          orders to the helmsman over time; without legs and waypoints, those of [tow] hold
    waypoints     places (x, y) [m] to which the helmsman goes one after the other, along straight lines from `position`, at the speed
                  `transit`; he turns a length of the hull ahead of each, and stops at the last
    transit       [m/s] over the ground
    depart        [s] at which the vessel leaves for its first waypoint; before, it keeps its place
    bollard_pull  [N] largest thrust ahead; the largest thrust astern is half of it
    yaw_moment    [N m] largest steering moment of a vessel without a drive
    drive         screws with rudders, or azimuth thrusters; without it, thrust and moment are given as ordered
    side_thrust   [N] of transverse thrusters
    acceleration  [m/s2] at which the vessel approaches an ordered speed
    skeg_area     [m2] of a fin under the stern, which keeps a short vessel on its course; felt in a run without particles
    superstructure_area  [m2] of what stands on deck, projected on the wind, from every side; the wind acts on the hull above the water too
    engine        "running", or "stopped": no thrust and no steering, whatever is ordered; with a drive of two screws also "port stopped"
                  and "starboard stopped"
    hauled        [m] of its tow line that its own winch has hauled in, negative: paid out; the line is `tow_line` of its boom less this
    thrust_order, side_thrust_order  [N] ahead and to port, which the machinery of a vessel without a helmsman gives as far as it can
    yaw_moment_order  [N m] counter-clockwise, likewise
    """

    COMPASS: ClassVar[str | None] = "heading_compass"
    KEY = "vessel"
    CATALOGUE = staticmethod(vessel_catalogue)
    USUAL_VALUES: ClassVar[Mapping[str, Any]] = MappingProxyType(
        dict.fromkeys(("length", "beam", "draft", "depth", "bollard_pull"), MISSING)
    )
    RELATIONS: ClassVar[tuple[Relation, ...]] = (
        above("depth", "draft"),
        exactly_one("drive", "yaw_moment"),
        only_with("legs waypoints", "control", "helmsman"),
        only_with(MACHINERY, "control", "manual"),
        at_most_one("legs", "waypoints"),
        together("waypoints", "transit"),
    )
    vessel: str | None = None
    length: float = quantity_of(HullSize, "length", default=None)
    beam: float = quantity_of(HullSize, "beam", default=None)
    draft: float = quantity_of(HullSize, "draft", default=None)
    depth: float = quantity_of(HullSize, "depth", default=None)
    shape: Literal["wigley", "barge"] = "barge"
    position: Point2 = quantity("m")
    heading: float = quantity("rad", default=0.0)
    control: Literal["helmsman", "manual"] = "helmsman"
    legs: tuple[LegSettings, ...] = ()
    waypoints: tuple[Point2, ...] = quantity("m", default=())
    transit: float | None = quantity("m/s", default=None, above=0.0, at_most=20.0)
    depart: float = quantity("s", default=0.0, at_least=0.0)
    bollard_pull: float = quantity_of(Propulsion, "bollard_pull", default=None)
    yaw_moment: float | None = quantity_of(Propulsion, "yaw_moment", default=None)
    drive: Drive | None = None
    side_thrust: float = quantity_of(Propulsion, "side_thrust")
    acceleration: float = quantity_of(ControlGains, "acceleration", default=0.1)
    skeg_area: float = quantity("m2", default=0.0, at_least=0.0)
    superstructure_area: float = quantity("m2", default=0.0, at_least=0.0)
    engine: Literal["running", "stopped", "port stopped", "starboard stopped"] = "running"
    hauled: float = quantity("m", default=0.0, at_least=-LONGEST_LINE, at_most=LONGEST_LINE)
    thrust_order: float = quantity("N", default=0.0)
    side_thrust_order: float = quantity("N", default=0.0)
    yaw_moment_order: float = quantity("N m", default=0.0)

    @property
    def follows_tow(self) -> bool:
        """True for a helmsman with no orders of his own, who takes those of [tow]."""
        return self.control == "helmsman" and not (self.legs or self.waypoints)

    @property
    def screws(self) -> tuple[bool, bool]:
        """The port and the starboard screw: true for one that runs."""
        return self.engine in ("running", "starboard stopped"), self.engine in ("running", "port stopped")

    def problems(self) -> Iterator[Problem]:
        """Check that a drive pulls, that screws are there to be stopped, and that places and times of a course differ."""
        if self.drive is not None and self.bollard_pull == 0.0:
            yield Problem("bollard_pull", "is 0, allowed with a drive: above 0 N")
        if " " in self.engine and (self.drive is None or self.drive.count < 2):
            yield Problem(
                "engine", f'is "{self.engine}", allowed: "running" or "stopped" without a drive of two screws'
            )
        if any(one == two for one, two in pairwise((self.position, *self.waypoints))):
            yield Problem(
                "waypoints", "are twice the same in a row, or begin at `position`; allowed: places that differ"
            )
        starts = [leg.start for leg in self.legs]
        if any(later <= earlier for earlier, later in pairwise(starts)):
            yield Problem("legs", f"start at {starts} s, allowed: each leg after the one before")


@dataclass(frozen=True, kw_only=True)
class ReelSettings(Section):
    """A reel on a quay, at the boom's first end, from which the boom runs out straight to its second end (*modelled*).

    stiffness    [N] axial stiffness EA of the line that stands for the brake; it holds the boom's inner end
    winch_speed  [m/s] at which the reel pays out, or takes in
    paid_out     [m] of boom outside the mouth that is ordered; without it, as laid: from the mouth to the second end
    """

    stiffness: float = quantity("N", default=4e5, above=0.0)
    winch_speed: float = quantity("m/s", default=0.4, above=0.0)
    paid_out: float | None = quantity("m", default=None, above=0.0)


@dataclass(frozen=True, kw_only=True)
class BoomSettings(CatalogueSection):
    """A boom of jointed segments, laid in a U or along a line between two ends.

    ends                for each end, the name of a vessel or a fixed point (x, y) [m]; two points must be nearer to each other than the
                        boom's length, by at least a thousandth
    boom                name of a boom of the catalogue (`oilsim booms`), which gives the values that are not stated here
    length              [m] of the boom along its skirt
    segments            number of rigid segments
    skirt_depth         [m] below the water; must be given without `boom`
    freeboard           [m] above the water; must be given without `boom`
    buoyancy_to_weight  gross: displacement of the whole boom / its weight; the float is sized to give it; without `boom`, 5
    skirt_thickness     [m] as built; in the simulation it is at least one particle spacing
    ballast_fraction    fraction of the mass that is a chain along the skirt's foot; a lighter boom needs more to stand upright; without
                        `boom`, 0.35
    base_width          [m] of the two tubes full of water of a shore-sealing boom: aground it rests on them, and seals (*modelled*)
    pocket              of a high-speed system: a covered bag at the middle with slower water (*modelled*); without particles only
    strength            [N] tension at which the boom parts; without it and `boom`, it never does
    section_length      [m] from connector to connector; without it and `boom`, the boom is one section
    connector_strength  [N] tension at which a connector fails; without it, the boom's strength
    tow_line            [m] length of line between each end and its vessel
    line_stiffness      [N] axial stiffness EA of these lines, which then only pull, have no mass and may be winched; without it, the lines
                        are rigid links
    line_breaking_load  [N] tension at which such a line parts; without it, it never does
    winch_speed         [m/s] at which such a line is winched to another `tow_line`, ordered while the run goes on
    reel                the first end, a point, is the mouth of a reel, from which the boom runs out; without particles only
    losses              "closures": what particles are too coarse to lose is modelled, taken out of the boom and labelled (docs/losses.md);
                        "resolved": only what particles lose by themselves
    bulge               "left" or "right", seen from the first end to the second: the side to which a boom with slack is laid; by default
                        the side to which the current drives a boom between fixed points, else the right
    stream              [rad] direction to which the water runs past the ends at the start (current less way made); the boom then starts in
                        the shape that it takes in this stream, also between ends that are not abreast (J, diversion)
    deployment          how the debrief grades it: "sweep" meets and holds oil under way, "funnel" hands it at its free end to a boom that
                        follows, "containment" holds it between moorings, "exclusion" keeps oil out of `area`, "diversion" leads oil into
                        `area`, "trial" finds the speeds at which it loses oil, without a grade; the default is a sweep if a vessel
                        holds an end, else a containment
    fed_by              names of the funnels whose oil the boom is to meet
    area                three or more corners (x, y) [m] of the water that an exclusion keeps clean, or to which a diversion leads the oil
    berth               (x, y) [m] to which the crew brings the second end; the debrief tells when it lies there
    parted              numbers of the joints that have parted, counted from 1 at the first end to segments - 1
    """

    KEY = "boom"
    CATALOGUE = staticmethod(boom_catalogue)
    USUAL_VALUES: ClassVar[Mapping[str, Any]] = MappingProxyType(
        {
            "skirt_depth": MISSING,
            "freeboard": MISSING,
            "buoyancy_to_weight": 5.0,
            "ballast_fraction": BoomDesign.ballast_fraction,
            "base_width": None,
            "strength": None,
            "section_length": None,
            "connector_strength": None,
            "pocket": None,
        }
    )
    RELATIONS: ClassVar[tuple[Relation, ...]] = (
        only_with("line_stiffness", "tow_line"),
        only_with("line_breaking_load", "line_stiffness"),
        at_most_one("reel", "stream", "bulge"),
    )
    ends: tuple[str | Point2, str | Point2] = reference("vessels")
    boom: str | None = None
    length: float = quantity_of(BoomDesign, "length")
    segments: int = quantity_of(BoomDesign, "segment_count", default=20)
    skirt_depth: float = quantity_of(BoomDesign, "skirt_depth", default=None)
    freeboard: float = quantity_of(BoomDesign, "freeboard", default=None)
    buoyancy_to_weight: float = quantity_of(BoomDesign, "buoyancy_to_weight", default=None)
    skirt_thickness: float = quantity_of(BoomDesign, "skirt_thickness", default=0.005)
    ballast_fraction: float = quantity_of(BoomDesign, "ballast_fraction", default=None)
    base_width: float | None = quantity_of(BoomDesign, "base_width")
    pocket: Pocket | None = None
    strength: float | None = quantity("N", default=None, above=0.0)
    section_length: float | None = quantity("m", default=None, above=0.0)
    connector_strength: float | None = quantity("N", default=None, above=0.0)
    tow_line: float = quantity("m", default=0.0, at_least=0.0, at_most=LONGEST_LINE)
    line_stiffness: float | None = quantity("N", default=None, above=0.0)
    line_breaking_load: float | None = quantity("N", default=None, above=0.0)
    reel: ReelSettings | None = None
    winch_speed: float = quantity("m/s", default=0.2, above=0.0)
    losses: Literal["closures", "resolved"] = "closures"
    bulge: Literal["left", "right"] | None = None
    stream: float | None = quantity("rad", default=None)
    deployment: Deployment | None = None
    fed_by: tuple[str, ...] = reference("booms", default=())
    area: tuple[Point2, ...] = quantity("m", default=())
    berth: Point2 | None = quantity("m", default=None)

    @property
    def kind(self) -> Deployment:
        """The kind of its deployment, stated or by its ends."""
        towed = any(isinstance(end, str) for end in self.ends)
        return self.deployment or ("sweep" if towed else "containment")

    parted: tuple[int, ...] = ()

    def strength_of(self, joint: int) -> float | None:
        """Return the tension [N] at which a joint, counted from 1, parts; None if none does."""
        return self.connector_strength or self.strength if joint in self.connectors else self.strength

    @property
    def connectors(self) -> tuple[int, ...]:
        """The numbers of the joints at which sections are connected, each the nearest to its place."""
        if self.section_length is None or self.section_length >= self.length:
            return ()
        segment = self.length / self.segments
        count = math.ceil(self.length / self.section_length - 1e-9) - 1
        numbers = {round((place + 1) * self.section_length / segment) for place in range(count)}
        return tuple(sorted(number for number in numbers if 0 < number < self.segments))

    @property
    def end_labels(self) -> tuple[str, ...]:
        """The names of the two ends: their vessels', or ``end-0`` and ``end-1`` at fixed points."""
        return tuple(end if isinstance(end, str) else f"end-{index}" for index, end in enumerate(self.ends))

    def problems(self) -> Iterator[Problem]:
        """Check that an area is there where the grade needs one, and that joints that part are there."""
        if self.deployment in ("exclusion", "diversion") and len(self.area) < 3:
            text = f'has {len(self.area)} corners, allowed: 3 or more with deployment = "{self.deployment}"'
            yield Problem("area", text)
        elif 0 < len(self.area) < 3:
            yield Problem("area", f"has {len(self.area)} corners, allowed: 3 or more")
        elif self.area and crosses_itself(self.area):
            yield Problem("area", "crosses or touches itself, allowed: corners in their order round the water")
        if self.reel is not None:
            yield from self._reel_problems(self.reel)
        last = self.segments - 1
        if not all(0 < number <= last for number in self.parted) or len(set(self.parted)) < len(self.parted):
            yield Problem("parted", f"is {list(self.parted)}, allowed: numbers from 1 to {last}, each once")

    def _reel_problems(self, reel: ReelSettings) -> Iterator[Problem]:
        """Yield why the boom cannot run off its reel."""
        if isinstance(self.ends[0], str):
            yield Problem("ends", f"begin with {self.ends[0]!r}, allowed with reel: a point (x, y), its mouth")
        if reel.paid_out is not None and reel.paid_out > self.length:
            text = f"is {reel.paid_out:g}, allowed: above 0 and at most length = {self.length:g} m"
            yield Problem("reel.paid_out", text)


def line_problems(vessels: Mapping[str, VesselSettings], booms: Mapping[str, BoomSettings]) -> Iterator[Problem]:
    """Yield the problems of vessels that haul in tow lines that no winch holds, or more of a line than there is."""
    for name, vessel in vessels.items():
        held = [boom.tow_line for boom in booms.values() if name in boom.ends and boom.line_stiffness is not None]
        if vessel.hauled != 0.0 and not held:
            text = f"is {vessel.hauled:g}, allowed: 0 m, as the vessel holds no boom whose lines have line_stiffness"
            yield Problem(f"vessels.{name}.hauled", text)
        elif held and not vessel.hauled < min(held):
            text = f"is {vessel.hauled:g}, allowed: below {min(held):g} m, the length of its tow line"
            yield Problem(f"vessels.{name}.hauled", text)
