"""Orders of an instructor in the words of the deck: ``tow.speed=0.36`` is "tow at 0.70 kn".

Orders of a crew are its acts: an exercise that needs orders is not passed by who gives none.
"""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Callable, Mapping
from fnmatch import fnmatch

from oilsim.core.physical_constants import KNOT
from recordings.model.words import course_in_words, levers_in_words, three_figures, volume_in_words
from recordings.replay.recording import Replay
from scenarios.schema.parsing.overrides import settings_of
from scenarios.schema.parsing.structuring import COMPASS, SUFFIXES

_COURSES = ("tow.heading", "wind.direction", "current.direction")


def order_in_words(text: str, bearing: float) -> str:
    """Return the text of an instructor's event in words; `bearing` [rad] of the x axis, clockwise from north."""
    settings = settings_of(text)
    return "; ".join(_in_words(setting, bearing) for setting in settings) if settings else text


def _in_words(setting: str, bearing: float) -> str:
    """Return one setting, ``key=value``, in words; as it is if it is none of the usual orders."""
    key, _, written = setting.partition("=")
    path, _, name = key.rpartition(".")
    try:
        value = float(written)
    except ValueError:
        vessel = key.removeprefix("vessels.").removesuffix(".legs")
        if key == f"vessels.{vessel}.legs":
            return _course_in_words(vessel, written, bearing)
        return _state_in_words(key, written) or setting
    if name in COMPASS:
        turned = value + (180.0 if name == "from_compass" else 0.0)
        key, value = f"{path}.{COMPASS[name]}", bearing - math.radians(turned)
    for suffix, (_, factor) in SUFFIXES.items():
        if key.endswith(suffix):
            key, value = key.removesuffix(suffix), factor * value
    key = key.removeprefix("sea.")
    if key in _COURSES:
        toward, origin = course_in_words(value, bearing), course_in_words(value + math.pi, bearing)
        return {"tow": f"tow heading {toward}", "wind": f"wind from {origin}", "current": f"current towards {toward}"}[
            key.split(".")[-2]
        ]
    if words := _line_in_words(key, value):
        return words
    for end, write in _WORDS.items():
        if fnmatch(key, end):
            return write(value, key)
    return setting


def _course_in_words(vessel: str, written: str, bearing: float) -> str:
    """Return a vessel's new legs in words; several, or such as cannot be read, without their speeds and headings."""
    try:
        (leg,) = tomllib.loads(f"legs={written}")["legs"]
        if "by_hand" in leg:
            return f"{vessel}: {levers_in_words(*map(float, leg['by_hand']))}, by hand"
        course = course_in_words(float(leg["heading"]), bearing)
        return f"{vessel}: make {float(leg['speed']) / KNOT:.2f} kn over the ground, heading {course}"
    except (ValueError, TypeError, KeyError):
        return f"a new course for {vessel}"


def _state_in_words(key: str, written: str) -> str:
    """Return an order to an engine, a boom or a tie in words; empty for another one."""
    match key.split("."):
        case ["vessels", vessel, "engine"]:
            side = written.strip("\"'").removesuffix("stopped")  # "port " or "starboard " for one of two screws
            return (
                f"the engine of {vessel} runs again"
                if side == "running"
                else f"the {side}engine of {vessel} has stopped"
            )
        case ["booms", boom, "parted"]:
            joints = [joint.strip() for joint in written.strip("[]").split(",")]
            return f"boom {boom} parts at joint{'s' if len(joints) > 1 else ''} {' and '.join(joints)}"
        case ["ties", tie, "made_fast"]:
            return f"the tie {tie} is made fast"
        case ["ties", tie, "parted"]:
            return f"the tie {tie} is cast off"
        case ["skimmers", skimmer, "running"]:
            return f"skimmer {skimmer} {'starts' if written == 'true' else 'stops'}"
        case ["skimmers", skimmer, "place"]:
            return (
                f"skimmer {skimmer} moves to {' and '.join(part.strip() for part in written.strip('[]').split(','))} m"
            )
        case ["injects", inject, "given"]:
            return f"the inject {inject} is given"
        case ["emitters", pipe]:
            return _release_in_words(pipe, written)
    return ""


def _line_in_words(key: str, meters: float) -> str:
    """Return an order to the winches of tow lines in words; empty for another one."""
    match key.split("."):
        case ["vessels", vessel, "hauled"]:
            end = (
                "as it was laid" if meters == 0.0 else f"{abs(meters):.1f} m {'shorter' if meters > 0.0 else 'longer'}"
            )
            return f"tow line of {vessel}: {end}"
        case ["booms", boom, "tow_line"]:
            return f"tow lines of boom {boom}: {meters:.1f} m"
        case ["booms", boom, "reel", "paid_out"]:
            return f"reel of boom {boom}: {meters:.1f} m out"
    return ""


def _release_in_words(pipe: str, written: str) -> str:
    """Return the order of a new pipe in words; empty for one that cannot be read, or that never closes."""
    try:
        settings = tomllib.loads(f"pipe={written}")["pipe"]
        volume = float(settings["volume"])
        seconds = volume / (math.pi * float(settings["radius"]) ** 2 * float(settings["speed"]))
    except (ValueError, TypeError, KeyError, ZeroDivisionError):
        return ""
    beside = f" beside {settings['on']}" if settings.get("on") else ""
    return f"pipe {pipe} releases {volume_in_words(volume)}{beside} within {three_figures(seconds)} s"


_WORDS: Mapping[str, Callable[[float, str], str]] = {
    "visibility": lambda value, _: f"visibility {three_figures(value)} m",
    "within": lambda value, _: f"within {three_figures(value / 60.0)} min" if value else "at once",
    "waves.*period": lambda value, _: f"waves of {three_figures(value)} s",
    "tow.speed": lambda value, _: f"tow at {value / KNOT:.2f} kn",
    "wind.speed": lambda value, _: f"wind {three_figures(value / KNOT)} kn",
    "current.speed": lambda value, _: f"current {value / KNOT:.2f} kn",
    "wind.gust_intensity": lambda value, _: f"gusts of {three_figures(100.0 * value)} % of the wind",
    "waves.significant_height": lambda value, _: f"waves {three_figures(value)} m high",
    "waves.height": lambda value, _: f"waves {three_figures(value)} m high",
    "skimmers.*.nameplate": lambda value, key: f"skimmer {key.split('.')[1]} pumps {three_figures(value)} m³/h at most",
    "emitters.*.speed": lambda value, key: (
        f"pipe {key.split('.')[1]} {'shut' if value == 0.0 else f'at {three_figures(value)} m/s'}"
    ),
}


# what crews order; engines that fail, lines that part and the weather are the instructor's
ACTS = (
    "tow.*", "vessels.*.legs*", "vessels.*_order=*", "*.hauled=*", "vessels.*.engine=*running*", "booms.*.tow_line=*",
    "booms.*.reel.paid_out=*", "ties.*.made_fast=*", "skimmers.*.running=true", "skimmers.*.place=*",
)  # fmt: skip


def crew_acted(replay: Replay) -> bool:
    """Return False if the recorded exercise needs orders, and nobody gave a vessel, a line or a skimmer one; else True.

    Injects come by themselves: one that lets a skimmer run again is no act of a crew.
    """
    plan = json.loads(str(replay.run.properties.get("plan") or "{}"))
    exercise = plan.get("scenario", {}).get("exercise") or {}
    return not exercise.get("needs_orders", False) or any(
        any(fnmatch(setting, act) for act in ACTS)
        for event in replay.events
        if event.is_by_people
        for setting in settings_of(event.text)
    )
