"""`conduct`: an exercise with its console, until the console is closed."""

from __future__ import annotations

import asyncio
import errno
import signal
import socket
import webbrowser
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from recordings.sink.viewer import LOOPBACK, ViewerError, WebViewer, web_viewer
from scenarios.conduct.access import Access, Places
from scenarios.conduct.commands import LONGEST
from scenarios.conduct.conducted_run import Errand
from scenarios.conduct.server import PageServer, running
from scenarios.conduct.session import Session
from scenarios.text.terminal import terminal

BACKLOG = 64  # [1] connections that wait to be taken
EVERYWHERE = ("0.0.0.0", "::")  # addresses by which a server listens at all of a machine's
FIRST_REQUEST = 5.0  # [s] within which a connection must ask for something, at first and after each answer
MOST_CONNECTIONS, OF_ONE_ADDRESS = 200, 120  # [1] at a time that are no pages, in all and of one address


@dataclass(frozen=True, kw_only=True)
class ConsoleOptions:
    """The place at which a console listens, and the things that it shows.

    host: address to listen at; port: 0 chooses a free one; password: asked for besides the token, needed with another host than this
    machine's own; opens: whether to open the instructor's page in the browser; shows_scene: whether pages embed a 3-D view.
    """

    host: str = LOOPBACK
    port: int = 0
    password: str | None = None
    opens: bool = True
    shows_scene: bool = True


def conduct(errand: Errand, vessels: Sequence[str], options: ConsoleOptions) -> int:
    """Serve the console of `errand` until it is told to stop; return the exit code. OSError for a place that is taken."""
    access = Access(vessels, options.password)
    with _listeners(options) as listeners, _scene(options) as viewer:
        host, port = listeners[0].getsockname()[:2]
        addresses = addresses_of(access, host, port)
        _tell(addresses, errand)
        if options.opens:
            with suppress(webbrowser.Error):
                webbrowser.open(addresses["instructor"])
        shown = errand if viewer is None else replace(errand, viewer=viewer.feed)
        asyncio.run(_serve(shown, access, listeners, viewer))
    return 0


def addresses_of(access: Access, host: str, port: int) -> Mapping[str, str]:
    """Return the address of each role's page."""
    name = socket.gethostname() if host in EVERYWHERE else host
    return {role.name: f"http://{name}:{port}/#{token}" for role, token in access.tokens.items()}


@contextmanager
def _listeners(options: ConsoleOptions) -> Iterator[list[socket.socket]]:
    """Listen at the place within the block; OSError if it is taken.

    A browser that calls `localhost` may try ::1 first. The console listens there too, so that no other program answers in its place.
    """
    with ExitStack() as stack:
        first = stack.enter_context(socket.create_server((options.host, options.port), backlog=BACKLOG))
        listeners = [first]
        if options.host == LOOPBACK:
            place = ("::1", first.getsockname()[1])
            try:
                listeners.append(
                    stack.enter_context(socket.create_server(place, family=socket.AF_INET6, backlog=BACKLOG))
                )
            except OSError as error:
                if error.errno == errno.EADDRINUSE:
                    raise  # any other reason: the machine has no IPv6
        yield listeners


@contextmanager
def _scene(options: ConsoleOptions) -> Iterator[WebViewer | None]:
    """Serve the 3-D view within the block; None where it is not wanted, or others can reach this machine, or it does not start."""
    with ExitStack() as stack:
        viewer = None
        if options.shows_scene and options.host == LOOPBACK:
            try:
                viewer = stack.enter_context(web_viewer())
            except ViewerError as error:
                terminal(stderr=True).print(f"oilsim: pages have no 3-D view: {error}", style="yellow", markup=False)
        yield viewer


async def _serve(errand: Errand, access: Access, listeners: list[socket.socket], view: WebViewer | None) -> None:
    """Serve pages, with the 3-D view `view`, until told to end."""
    host = listeners[0].getsockname()[0]
    server: PageServer | None = None

    def changed() -> None:
        if server is not None:
            server.notice()

    session = Session(errand, changed)
    hosts = ["*"] if host in EVERYWHERE else [host, "localhost"]
    server = PageServer(access, session, hosts=hosts, viewer=view)
    config = uvicorn.Config(
        server.application,
        http=partial(_Prompt, Places(MOST_CONNECTIONS, OF_ONE_ADDRESS)),  # type: ignore[arg-type]
        ws="websockets-sansio",
        ws_max_size=LONGEST,
        ws_per_message_deflate=False,
        log_level="error",
        server_header=False,
        timeout_graceful_shutdown=2,
        lifespan="off",
    )
    pages = _PageProcess(config)
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        loop.add_signal_handler(number, pages.end)
    async with running(session):
        await pages.serve(sockets=listeners)


class _Prompt(H11Protocol):
    """A connection that is closed unless a whole request comes within `FIRST_REQUEST` seconds, however slowly its headers arrive.

    It has a place among strangers until it is a page's.
    """

    def __init__(self, places: Places, *arguments: Any, **keywords: Any) -> None:
        super().__init__(*arguments, **keywords)
        self._places = places
        self._patience: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take a place, and begin to wait for the request."""
        super().connection_made(transport)
        address = str((transport.get_extra_info("peername") or ("",))[0])
        self._places.enter(self, address, transport.abort)
        self._wait()

    def connection_lost(self, exc: Exception | None) -> None:
        """Give the place back."""
        self._rest()
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Give the place back: from now on the page's token is waited for."""
        self._rest()
        super().handle_websocket_upgrade(event)

    def on_response_complete(self) -> None:
        """Wait for the next request."""
        super().on_response_complete()
        self._wait()

    def _wait(self) -> None:
        if self._patience is not None:
            self._patience.cancel()
        self._patience = self.loop.call_later(FIRST_REQUEST, self._end_unasked)

    def _rest(self) -> None:
        self._places.leave(self)
        if self._patience is not None:
            self._patience.cancel()

    def _end_unasked(self) -> None:
        is_served = self.cycle is not None and not self.cycle.response_complete
        if not is_served and not self.transport.is_closing():
            self.transport.close()


class _PageProcess(uvicorn.Server):
    """A server that leaves signals to the console, which has a run to end."""

    def end(self) -> None:
        """Serve no more; pages that are open are closed."""
        self.should_exit = True

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Take no signals."""
        yield


def _tell(addresses: Mapping[str, str], errand: Errand) -> None:
    """Print the addresses of the pages."""
    console = terminal()
    console.print(
        f"conduct {errand.scenario}, recorded in {errand.record}; Ctrl-C ends it", highlight=False, markup=False
    )
    width = max(map(len, addresses))
    for name, address in addresses.items():
        console.print(f"  {name:<{width}}  {address}", highlight=False, markup=False, soft_wrap=True)
