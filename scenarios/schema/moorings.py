"""Moorings: legs of chain and rope from booms, vessels and floating bodies down to anchors on the ground; and ties between booms."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

from oilsim.core.quantity import quantity, quantity_of
from scenarios.schema.exercise import LONGEST_LINE, BoomSettings
from scenarios.schema.parsing.quantity_fields import Point2, Section
from scenarios.schema.parsing.relations import Relation, exactly_one, needed_with, only_with, reference
from scenarios.text.problems import Problem
from vessels.ground_tackle import AnchorSize, Rope


@dataclass(frozen=True, kw_only=True)
class PartSettings(Section):
    """A length of chain or rope.

    length, diameter  [m]; the diameter of a chain is that of its bar
    material          "chain" (grade 2), "wire", "polyester", "nylon" or "polypropylene" (which floats; its lift is left out)
    breaking_load     [N] of used rope; by default that of new rope
    """

    material: Literal["chain", "wire", "polyester", "nylon", "polypropylene"]
    length: float = quantity_of(Rope, "length")
    diameter: float = quantity_of(Rope, "diameter")
    breaking_load: float | None = quantity("N", default=None, above=0.0)


@dataclass(frozen=True, kw_only=True)
class MooringSettings(Section):
    """A mooring leg from a boom, a vessel or a floating body to an anchor on the ground.

    boom     a boom, made fast at
    joint    its joint of this number, counted from its first end: 0 is the first end, `segments` the second; an end at a fixed point of
             `ends` then starts there, and only its moorings hold it
    vessel   a vessel, made fast at
    at       its bow, stern, port or starboard side, at the height of the deck; or
    body     a body of [bodies], made fast at its lowest point
    anchor   (x, y) [m] where the anchor lies on the ground at the start
    ground   "sand", "mud", "clay" or "rock"; it is flat, at the depth of the sea or of the tank
    kind     "fluke" (Danforth and its like), "stockless" (a ship's), "weight" (concrete), or "fixed" (a pile, a rock bolt), which never
             drags unless it has a `holding`
    mass     [kg] of the anchor
    holding  [N] holding power under a level pull, as tested; by default that of its kind, mass and ground (page "Moorings")
    parts    chains and ropes, from the anchor up
    parted   whether the leg is cast off or broken
    hauled   [m] of the uppermost part that a winch has hauled in, negative: paid out; may be ordered while the run goes on
    winch_speed  [m/s] at which it hauls and pays out
    """

    RELATIONS: ClassVar[tuple[Relation, ...]] = (
        exactly_one("boom", "vessel", "body"),
        only_with("joint", "boom"),
        needed_with("mass", "kind", "fluke", "stockless", "weight"),
    )
    boom: str | None = reference("booms", default=None)
    joint: int = quantity("", default=0, at_least=0.0, whole=True)
    vessel: str | None = reference("vessels", default=None)
    at: Literal["bow", "stern", "port", "starboard"] = "bow"
    body: str | None = reference("bodies", default=None)
    anchor: Point2 = quantity("m")
    ground: Literal["sand", "mud", "clay", "rock"] = "sand"
    kind: Literal["fluke", "stockless", "weight", "fixed"] = "fluke"
    mass: float | None = quantity_of(AnchorSize, "mass", default=None)
    holding: float | None = quantity("N", default=None, above=0.0)
    parts: tuple[PartSettings, ...]
    parted: bool = False
    hauled: float = quantity("m", default=0.0, at_least=-LONGEST_LINE, at_most=LONGEST_LINE)
    winch_speed: float = quantity("m/s", default=0.2, above=0.0)

    def problems(self) -> Iterator[Problem]:
        """Check that the leg has parts, and an anchor that finds hold in its ground."""
        if not self.parts:
            yield Problem("parts", "is empty, allowed: one part or more, from the anchor up")
        elif not self.hauled < self.parts[-1].length:
            text = f"is {self.hauled:g}, allowed: below {self.parts[-1].length:g} m, the length of the uppermost part"
            yield Problem("hauled", text)
        if self.kind in ("fluke", "stockless") and self.ground == "rock" and self.holding is None:
            text = f'is "{self.kind}", which finds no hold on rock; allowed there: "weight", "fixed", or a holding as tested'
            yield Problem("kind", text)


@dataclass(frozen=True, kw_only=True)
class TieSettings(Section):
    """An elastic line between two joints of booms: the cross bridle of a V sweep, the line across an open apex, a connection of two booms.

    Its booms need `stream`, and start together in the shape in which they and their ties hang in it. The line has no mass. With `place` it
    goes from one boom to a bollard or winch ashore, as the line by which a boom is paid out from a slip.

    With `reach` the tie holds nothing at the start, and its booms lie as if it were not there: it waits until a crew has brought its two
    ends within reach, and orders ties.NAME.made_fast=true. Then the line is as long as the ends are apart, and its winch hauls it in to
    `length`.

    booms      names of the two booms, the same twice for a cross bridle; with `place` of one
    joints     of each boom its joint of this number, 0 is its first end and `segments` its second; an end at a fixed point of `ends` is
               then free: `ends` only says about where it starts, and the tie holds it
    place      (x, y) [m] of a bollard or winch, as high as the joint is at the start; the tie is taut then, and has no `length`
    length     [m] between the two joints, without tension
    reach      [m] distance of its ends within which a crew can make it fast; without it, the tie is fast from the start
    made_fast  whether a tie with `reach` has been made fast; may be ordered while the run goes on, and is false at the start
    hauled     [m] of the line that a winch has hauled in, negative: paid out; may be ordered while the run goes on
    winch_speed  [m/s] at which it hauls and pays out
    stiffness  [N] axial stiffness EA
    breaking_load  [N] tension at which it parts; without it, it never does
    parted     whether it is cast off or broken; may be ordered while the run goes on
    """

    RELATIONS: ClassVar[tuple[Relation, ...]] = (only_with("made_fast", "reach"),)
    booms: tuple[str, ...] = reference("booms")
    joints: tuple[int, ...] = quantity("", at_least=0, whole=True)
    place: Point2 | None = quantity("m", default=None)
    length: float | None = quantity("m", default=None, above=0.0)
    stiffness: float = quantity("N", above=0.0)
    breaking_load: float | None = quantity("N", default=None, above=0.0)
    hauled: float = quantity("m", default=0.0, at_least=-LONGEST_LINE, at_most=LONGEST_LINE)
    winch_speed: float = quantity("m/s", default=0.2, above=0.0)
    parted: bool = False
    reach: float | None = quantity("m", default=None, above=0.0)
    made_fast: bool = False

    @property
    def waits(self) -> bool:
        """True for a tie that is made fast while the run goes on."""
        return self.reach is not None

    def problems(self) -> Iterator[Problem]:
        """Check that there are two ends, that they differ, and that the line has a length."""
        count = 2 if self.place is None else 1
        for name, given in (("booms", self.booms), ("joints", self.joints)):
            if len(given) != count:
                allowed = "2 without place" if count == 2 else "1 with place"
                yield Problem(name, f"has {len(given)} entries, allowed: {allowed}")
        if self.length is None and (self.place is None or self.waits):
            yield Problem("length", "is missing")
        if self.length is not None and self.place is not None and not self.waits:
            yield Problem("length", "is given beside place, allowed: one of the two, or both with reach")
        if len(self.booms) != 2 or len(self.joints) != 2:
            return
        if self.booms[0] == self.booms[1] and self.joints[0] == self.joints[1]:
            yield Problem("joints", f"are {list(self.joints)} of one boom, allowed: two joints that differ")


def held_ends(moorings: Mapping[str, MooringSettings], boom: str, segments: int) -> tuple[bool, bool]:
    """Return whether moorings hold the first and the second end of a boom."""
    joints = {leg.joint for leg in moorings.values() if leg.boom == boom}
    return 0 in joints, segments in joints


def leg_that_holds(moorings: Mapping[str, MooringSettings], boom: str, joint: int) -> str | None:
    """Return the first mooring that holds a boom at a joint; None without one."""
    return next((name for name, leg in moorings.items() if (leg.boom, leg.joint) == (boom, joint)), None)


def tied_ends(ties: Mapping[str, TieSettings], boom: str, segments: int) -> tuple[str | None, str | None]:
    """Return the ties that hold the first and the second end of a boom, None for an end without one."""
    found = {
        joint: name
        for name, tie in ties.items()
        if not tie.waits
        for other, joint in zip(tie.booms, tie.joints, strict=False)
        if other == boom
    }
    return found.get(0), found.get(segments)


def tie_problems(ties: Mapping[str, TieSettings], booms: Mapping[str, BoomSettings]) -> Iterator[Problem]:
    """Yield the problems between ties and their booms."""
    streams = dict[str, float]()
    for name, tie in ties.items():
        for boom, joint in zip(tie.booms, tie.joints, strict=False):
            settings = booms.get(boom)
            if settings is None:
                continue
            if joint > settings.segments:
                text = f"holds {joint}, allowed: 0 to {settings.segments}, the segments of boom {boom!r}"
                yield Problem(f"ties.{name}.joints", text)
            if tie.waits:
                continue
            end = {0: settings.ends[0], settings.segments: settings.ends[1]}.get(joint)
            if isinstance(end, str):
                text = f"holds {joint} of {boom!r}, the end that vessel {end!r} holds; allowed: another joint, or an end at a point"
                yield Problem(f"ties.{name}.joints", text)
            if tie.place is not None:
                continue
            if settings.stream is None:
                text = f"is missing, allowed: a direction, because tie {name!r} holds the boom"
                yield Problem(f"booms.{boom}.stream", text)
            else:
                streams[boom] = settings.stream
    if len(set(streams.values())) > 1:
        text = f"differs among the tied booms {', '.join(streams)}, allowed: one stream"
        yield Problem(f"booms.{next(iter(streams))}.stream", text)


def mooring_problems(moorings: Mapping[str, MooringSettings], booms: Mapping[str, BoomSettings]) -> Iterator[Problem]:
    """Yield the problems between moorings and the booms that they hold."""
    for name, leg in moorings.items():
        path = f"moorings.{name}"
        boom = booms.get(leg.boom or "")
        if boom is None:
            continue
        if leg.joint > boom.segments:
            text = f"is {leg.joint}, allowed: 0 to {boom.segments}, the segments of boom {leg.boom!r}"
            yield Problem(f"{path}.joint", text)
        end = {0: boom.ends[0], boom.segments: boom.ends[1]}.get(leg.joint)
        if isinstance(end, str):
            text = f"is {leg.joint}, the end that vessel {end!r} holds; allowed: another joint, or an end at a point"
            yield Problem(f"{path}.joint", text)


def reel_problems(
    booms: Mapping[str, BoomSettings], moorings: Mapping[str, MooringSettings], ties: Mapping[str, TieSettings]
) -> Iterator[Problem]:
    """Yield reels whose boom is held twice."""
    for name, boom in booms.items():
        held = any(held_ends(moorings, name, boom.segments)[:1]) or tied_ends(ties, name, boom.segments)[0]
        if boom.reel is not None and held:
            yield Problem(f"booms.{name}.reel", "is given, allowed: without a mooring or a tie at joint 0")
