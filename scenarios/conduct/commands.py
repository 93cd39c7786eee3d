"""Commands from a page: one JSON object each, checked before anything is done with it.

A command has an `id`, which its answer repeats, and a verb `do`:

verb                        entries
pause, go-on, step, end
pace                        value: simulated seconds a second, null as fast as it can
mark                        name
say                         to: a vessel, the instructor or all stations; text
introduce                   name: of the person in front of the page, under which its orders stand in the log
order                       settings: texts KEY=VALUE, as for `oilsim order`
tow                         speed [m/s], heading [rad]: orders to all vessels that have no own ones
steer                       vessel, speed [m/s], heading [rad], keeps_line
levers                      vessel, thrust ahead and steering counter-clockwise by hand, -1 to 1 of the largest
engine                      vessel, runs
line                        vessel, length [m] to which its winch brings its own tow line
skim                        vessel, settings: orders to the skimmers that its crew works with
branch                      time [s], recording: that of the mark there, null for a moment of the present run, settings: orders there
debrief                     of the recording so far
what-if                     time [s] of the run that people conducted last, settings: orders there; all other orders are given again
look                        time [s]: the state nearest to it, for a page that looks back
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from scenarios.controls.table import KEYS_OF_CREWS
from scenarios.text.problems import Problem, ScenarioError
from scenarios.text.toml import read_object

LONGEST = 16 * 1024  # [bytes] of a message from a page
MOST_SETTINGS = 50  # [1] in an order
LONGEST_TEXT = 2000  # [1] letters of a text in a command
DEEPEST = 1e6  # [1] largest number in a command

_ENTRIES: Mapping[str, Mapping[str, str]] = {
    "pause": {},
    "go-on": {},
    "step": {},
    "end": {},
    "debrief": {},
    "look": {"time": "number"},
    "pace": {"value": "number or null"},
    "mark": {"name": "text"},
    "say": {"to": "text", "text": "text"},
    "introduce": {"name": "text"},
    "order": {"settings": "texts"},
    "tow": {"speed": "number", "heading": "number"},
    "steer": {"vessel": "text", "speed": "number", "heading": "number", "keeps_line": "yes or no"},
    "levers": {"vessel": "text", "thrust": "number", "steering": "number"},
    "engine": {"vessel": "text", "runs": "yes or no"},
    "line": {"vessel": "text", "length": "number"},
    "skim": {"vessel": "text", "settings": "texts"},
    "branch": {"time": "number", "recording": "text or null", "settings": "texts"},
    "what-if": {"time": "number", "settings": "texts"},
}


@dataclass(frozen=True)
class Command:
    """A command with all the entries of its verb."""

    id: int
    verb: str
    entries: Mapping[str, Any]


def read_message(text: str | bytes) -> dict[str, Any]:
    """Read a message; ScenarioError for one that is too long or no JSON object."""
    raw = text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text
    if len(raw) > LONGEST:
        raise refused("the message", f"has {len(raw)} bytes, allowed: up to {LONGEST}")
    data = read_object(raw)
    if data is None:
        raise refused("the message", "cannot be read, allowed: a JSON object")
    return data


def read_command(data: Mapping[str, Any]) -> Command:
    """Read a command; ScenarioError, which names every entry that is wrong."""
    number, verb = data.get("id"), data.get("do")
    if not isinstance(number, int) or isinstance(number, bool) or abs(number) > DEEPEST:
        raise refused("id", "is no whole number, allowed: a number by which the page knows the answer")
    if not isinstance(verb, str) or verb not in _ENTRIES:
        raise refused("do", f"is {str(verb)[:40]!r}, allowed: {', '.join(_ENTRIES)}")
    wanted, given = _ENTRIES[verb], {key: value for key, value in data.items() if key not in ("id", "do")}
    problems = [Problem(str(key)[:40], f"is no entry of {verb}") for key in given if key not in wanted]
    problems += [
        Problem(key, f"is {str(given.get(key))[:40]!r}, allowed: {kind}")
        for key, kind in wanted.items()
        if key not in given or not _is_a(kind, given[key])
    ]
    if problems:
        raise ScenarioError(problems, "oilsim")
    return Command(number, verb, given)


def settings_of(
    command: Command, vessels: Mapping[str, Any], skimmers: Mapping[str, Sequence[str]] = MappingProxyType({})
) -> Sequence[str]:
    """Return the settings of the order that a command asks for; ScenarioError for another vessel, or what its crew may not order.

    vessels: present states by name; skimmers: names of those that the crew of each works with.
    """
    verb, entries = command.verb, command.entries
    if verb == "order":
        return list(entries["settings"])
    if verb == "tow":
        return [f"tow.speed={entries['speed']!r}", f"tow.heading={entries['heading']!r}"]
    vessel = entries["vessel"]
    present = vessels.get(vessel)
    if present is None:
        raise refused("vessel", f"is {vessel!r}, allowed: {', '.join(vessels) or 'none'}")
    if verb == "skim":
        return _of_skimmers(entries["settings"], skimmers.get(vessel, ()))
    if verb == "engine":
        return [f"vessels.{vessel}.engine={'running' if entries['runs'] else 'stopped'}"]
    if verb == "line":
        if present["line"] is None:
            raise refused("vessel", f"is {vessel!r}, allowed: one with an elastic tow line, which a winch can haul")
        return [f"vessels.{vessel}.hauled={present['line']['laid'] - entries['length']!r}"]
    if verb == "levers":
        levers = f"[{entries['thrust']!r},{entries['steering']!r}]"
        return [f"vessels.{vessel}.legs=[{{speed=0.0,heading={present['heading']!r},by_hand={levers}}}]"]
    line = f",through=[{present['x']!r},{present['y']!r}]" if entries["keeps_line"] else ""
    leg = f"{{speed={entries['speed']!r},heading={entries['heading']!r}{line}}}"
    return [f"vessels.{vessel}.legs=[{leg}]"]


def _of_skimmers(settings: Sequence[str], own: Sequence[str]) -> Sequence[str]:
    """Return settings of a crew's `own` skimmers; ScenarioError for all that are none."""
    allowed = [key.replace("*", name, 1) for name in own for key in KEYS_OF_CREWS]
    paths = [one.partition("=")[0].strip() for one in settings]
    listed = ", ".join(allowed) or "none, since no skimmer is at this vessel or its boom"
    problems = [Problem(path, f"is not for this crew, allowed: {listed}") for path in paths if path not in allowed]
    if problems:
        raise ScenarioError(problems, "oilsim")
    return list(settings)


def _is_a(kind: str, value: Any) -> bool:
    match kind:
        case "number":
            return _is_number(value)
        case "number or null":
            return value is None or _is_number(value)
        case "text or null":
            return value is None or _is_text(value)
        case "yes or no":
            return isinstance(value, bool)
        case "texts":
            return isinstance(value, list) and len(value) <= MOST_SETTINGS and all(_is_text(one) for one in value)
        case _:
            return _is_text(value)


def _is_number(value: Any) -> bool:
    return (
        isinstance(value, int | float)
        and not isinstance(value, bool)
        and abs(value) <= DEEPEST
        and math.isfinite(float(value))
    )


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and 0 < len(value) <= LONGEST_TEXT and value.isprintable()


def refused(place: str, text: str) -> ScenarioError:
    """Return the refusal of a command, at a place."""
    return ScenarioError([Problem(place, text)], "oilsim")
