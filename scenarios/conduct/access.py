"""Access to a console: a role for each page, a random token for each role, and what each role may do.

Places for those who have not shown who they are: few, counted by address, and the oldest gives way to the newest.

So nobody locks anybody out by holding places: whoever comes gets one, and has seconds to show a token. Where places are few, one of the
address that holds most of them is freed.
"""

from __future__ import annotations

import hmac
import secrets
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from recordings.model.frame import CREW, INSTRUCTOR


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
