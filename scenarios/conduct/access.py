"""Access to a console: a role for each page, a random token for each role, and what each role may do.

Places for those who have not shown who they are: few, counted by address, and the oldest gives way to the newest.

So nobody locks anybody out by holding places: whoever comes gets one, and has seconds to show a token. Where places are few, one of the
address that holds most of them is freed.

Secrets: injects before they are noticed, faults that the instructor makes, marks and notes. Crews and observers get an inject's text,
without its name and its orders, and of orders those that a crew hears or sees: courses and speeds, winches, the weather, and all that acts
on its own vessel and skimmers.
"""

from __future__ import annotations

import hmac
import secrets
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatch
from typing import Any

from recordings.model.frame import CREW, INJECTS, INSTRUCTOR
from scenarios.debrief.order_words import ACTS, order_in_words
from scenarios.running.plan import Action
from scenarios.schema.parsing.overrides import settings_of


class Places:
    """Places of strangers, each with its address and the call that closes it."""

    def __init__(self, most: int, of_one_address: int) -> None:
        """Hold `most` places in all, and so many of one address."""
        self._most, self._of_one_address = most, of_one_address
        self._taken: dict[object, tuple[str, Callable[[], object]]] = {}  # in order of arrival

    def enter(self, who: object, address: str, close: Callable[[], object]) -> None:
        """Give a place; if there are too many, one that is held longest is closed."""
        held = Counter(place for place, _ in self._taken.values())
        if held[address] >= self._of_one_address:
            self._free(address)
        elif len(self._taken) >= self._most:
            self._free(held.most_common(1)[0][0])
        self._taken[who] = address, close

    def leave(self, who: object) -> None:
        """Take a place back; nothing for one that has none."""
        self._taken.pop(who, None)

    def _free(self, address: str) -> None:
        oldest = next(who for who, (place, _) in self._taken.items() if place == address)
        _, close = self._taken.pop(oldest)
        close()


OBSERVER, VESSEL = "observer", "vessel"

CREW_MAY = frozenset({"steer", "levers", "engine", "line", "skim"})  # with its own vessel only
MOST_FAILURES = (
    20  # [1] wrong tokens or passwords of one address within `FORGETS`, beyond which nobody new is let in from there
)
FORGETS = 60.0  # [s]


@dataclass(frozen=True)
class Role:
    """The role of a page: instructor, observer, or the crew of the vessel `vessel`; `person`: who says to be in front of it."""

    kind: str
    vessel: str = ""
    person: str = field(default="", compare=False)

    @property
    def name(self) -> str:
        """The name in the log and in the address: instructor, observer, or the vessel's."""
        return self.vessel or self.kind

    @property
    def source(self) -> str:
        """The source of this role's orders in the log, as "crew port (Ana)"."""
        station = f"{CREW} {self.vessel}" if self.vessel else self.kind
        return f"{station} ({self.person})" if self.person else station

    def may(self, verb: str, vessel: str = "") -> bool:
        """Return whether the role may give a command, to a vessel if it is one to a vessel."""
        if self.kind == INSTRUCTOR or verb == "introduce":
            return True
        if verb == "say":
            return self.kind == VESSEL
        return self.kind == VESSEL and verb in CREW_MAY and vessel == self.vessel


class Access:
    """The tokens of all roles; a page shows one, and where there is a password, that as well."""

    def __init__(self, vessels: Sequence[str], password: str | None = None) -> None:
        """Make a token for each role; `password` None: the token is enough."""
        roles = [Role(INSTRUCTOR), *(Role(VESSEL, name) for name in vessels), Role(OBSERVER)]
        self._tokens = {secrets.token_urlsafe(18): role for role in roles}
        self._password = password
        self._failures: dict[str, list[float]] = {}  # times [s], by address

    @property
    def needs_password(self) -> bool:
        """True if a token alone opens nothing."""
        return self._password is not None

    @property
    def tokens(self) -> Mapping[Role, str]:
        """The token of each role."""
        return {role: token for token, role in self._tokens.items()}

    def role_of(self, token: str, password: str = "", address: str = "") -> Role | None:
        """Return the role that a token opens; None for a wrong token or password, and while too many wrong ones come from an address."""
        now = time.monotonic()
        recent = {place: [then for then in times if now - then < FORGETS] for place, times in self._failures.items()}
        self._failures = {place: times for place, times in recent.items() if times}
        if self.needs_password and len(self._failures.get(address, ())) >= MOST_FAILURES:
            return None
        found = None
        for own, role in self._tokens.items():
            if _same(own, token):
                found = role
        if self._password is not None and not _same(self._password, password):
            found = None
        if found is None:
            self._failures.setdefault(address, []).append(now)
        return found


def _same(own: str, given: str) -> bool:
    return hmac.compare_digest(own.encode(), given.encode("utf-8", "replace"))


_INJECT = "inject "  # how the source of an inject's text begins
_OF_INSTRUCTOR = ("injects", "notes")  # entries of a scene


def scene_seen(role: Role, scene: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a role sees of a scene."""
    hidden = () if role.kind == INSTRUCTOR else _OF_INSTRUCTOR
    return {name: value for name, value in scene.items() if name not in hidden}


def summary_seen(role: Role, summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a role sees of a session's facts: marks are the instructor's."""
    return dict(summary) if role.kind == INSTRUCTOR else {**summary, "marks": []}


def line_seen(role: Role, line: Mapping[str, Any], scene: Mapping[str, Any] | None) -> Mapping[str, Any] | None:
    """Return a line of the log as a role sees it; None if it does not."""
    if role.kind == INSTRUCTOR or scene is None:
        return line if role.kind == INSTRUCTOR or not _is_secret(line) else None
    if line["source"].startswith(_INJECT):
        return _noticed(role, line, scene)
    settings = settings_of(line["text"]) if line.get("order") else ()
    if not settings:
        return None if line["mark"] else line
    seen = () if line["source"] == INJECTS else tuple(_heard(role, settings, scene))
    words = order_in_words(Action(index=0, settings=seen).text, scene["bearing"])
    return {**line, "text": words, "words": words} if seen else None


def _is_secret(line: Mapping[str, Any]) -> bool:
    """Return whether a line tells of injects, orders or marks."""
    return bool(line.get("order") or line["mark"] or line["source"].startswith(_INJECT))


def _noticed(role: Role, line: Mapping[str, Any], scene: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return the text of an inject that has been given, to a crew that notices it; an observer notices all."""
    name = line["source"].removeprefix(_INJECT)
    inject = next((one for one in scene["injects"] if one["name"] == name), None)
    if inject is None or line["text"] != inject["text"]:
        return None  # it has no text, or could not be given
    is_told = role.kind != VESSEL or not inject["to"] or role.vessel in inject["to"]
    return {**line, "source": ""} if is_told else None


def _heard(role: Role, settings: tuple[str, ...], scene: Mapping[str, Any]) -> Iterator[str]:
    """Yield those settings of an order that a crew hears or sees; of an inject given by hand none, its text tells."""
    if any(fnmatch(setting, "injects.*") for setting in settings):
        return
    own = [f"vessels.{one['name']}.*" for one in scene["vessels"] if role.kind != VESSEL or one["name"] == role.vessel]
    own += [f"skimmers.{name}.*" for one in scene["vessels"] if one["name"] == role.vessel for name in one["skimmers"]]
    yield from (setting for setting in settings if any(fnmatch(setting, key) for key in (*ACTS, "sea.*", *own)))
