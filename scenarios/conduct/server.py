"""The page's server: static files for everybody who reaches it, and one web socket for pages that show a token.

It listens on this machine only, unless told otherwise. Static files hold nothing secret. The token is in the part of the address after #,
which browsers send to nobody; a page shows it in its first message. Pages of other origins are refused, and so are more than `MOST_PAGES`.
"""

from __future__ import annotations

import asyncio
import json
import secrets
import urllib.error
import urllib.request
from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import quote

from starlette.applications import Starlette
from starlette.datastructures import Headers
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import HTTPConnection, Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from recordings.model.frame import INSTRUCTOR
from recordings.sink.viewer import WebViewer
from scenarios.conduct.access import Access, Places, Role, line_seen, scene_seen, summary_seen
from scenarios.conduct.commands import read_command, read_message
from scenarios.conduct.session import Session
from scenarios.text.problems import ScenarioError

_OTHER_NAME = {"127.0.0.1": "localhost", "localhost": "127.0.0.1"}
PATIENCE = 30.0  # [s] that the viewer's server may take over a file
NAMES = ("re_viewer.js", "re_viewer_bg.wasm")


def other_origin(host: str) -> str:
    """Return the origin of this machine's other name, as http://localhost:8000 for the host 127.0.0.1:8000; empty for other hosts."""
    name, _, port = host.partition(":")
    return f"http://{_OTHER_NAME[name]}:{port}" if name in _OTHER_NAME else ""


def policy(host: str) -> dict[str, str]:
    """Return the headers of the viewer's page and files for a request to `host`: only the page of the other name may embed them."""
    return {
        "content-security-policy": "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; "
        "img-src 'self' data: blob:; connect-src 'self' http://127.0.0.1:*; worker-src 'none'; base-uri 'none'; "
        f"frame-ancestors {other_origin(host)}",
    }


class ViewerFiles:
    """Passes on the files of the viewer's own server, which listens on this machine."""

    def __init__(self, origin: str) -> None:
        """Pass on files from `origin`, as http://127.0.0.1:9090."""
        self._origin = origin
        self._kept: dict[str, tuple[bytes, str]] = {}

    async def answer(self, request: Request) -> Response:
        """Return a file."""
        name = request.path_params["name"]
        if name not in NAMES:
            return PlainTextResponse("there is no such file", status_code=404)
        try:
            if name not in self._kept:
                self._kept[name] = await asyncio.to_thread(self._fetched, name)
        except (OSError, urllib.error.URLError):
            return PlainTextResponse("there is no such file", status_code=404)
        content, kind = self._kept[name]
        return Response(content, media_type=kind, headers=policy(request.headers["host"]))

    def _fetched(self, name: str) -> tuple[bytes, str]:
        """Fetch a file once; OSError if there is none."""
        with urllib.request.urlopen(f"{self._origin}/{name}", timeout=PATIENCE) as answer:
            return answer.read(), answer.headers.get_content_type()


SLOWEST = 20.0  # [s] that a page may take to read one message


class PageLink:
    """Sends a page what has changed since it last read; of states only the latest."""

    def __init__(self, socket: WebSocket, role: Role, session: Session) -> None:
        """Serve the page behind `socket`, which has shown that it is in this role."""
        self.socket, self.role, self._session = socket, role, session
        self._changed = asyncio.Event()
        self._run = -1
        self._line = 0
        self._summary = self._state = ""
        self._given: list[str] | None = None
        self._answers: list[dict[str, Any]] = []

    def notice(self) -> None:
        """Take note that there is more to show."""
        self._changed.set()

    def answer(self, number: int, **entries: object) -> None:
        """Answer a command."""
        self._answers.append({"kind": "answer", "id": number, **entries})
        self._changed.set()

    async def send_all(self, first: dict[str, Any]) -> None:
        """Send `first`, and then all that changes, until the page is closed; TimeoutError for one that does not read."""
        await self._send(json.dumps(first))
        while True:
            self._changed.clear()
            for text in self._news():
                await self._send(text)
            await self._changed.wait()

    async def _send(self, text: str) -> None:
        async with asyncio.timeout(SLOWEST):
            await self.socket.send_text(text)

    def _news(self) -> Iterator[str]:
        """Yield the messages that the page has not been sent."""
        session = self._session
        while self._answers:
            yield json.dumps(self._answers.pop(0))
        summary = json.dumps(summary_seen(self.role, session.summary))
        if summary != self._summary:
            self._summary = summary
            yield summary
        if session.scene is not None and session.run_number != self._run and session.phase != "building":
            self._run, self._given = session.run_number, None
            yield json.dumps(scene_seen(self.role, session.scene))
            yield json.dumps({"kind": "history", "rows": session.history.rows})
        seen = [line_seen(self.role, line, session.scene) for line in session.lines if line["number"] > self._line]
        self._line = session.line_count
        if news := [line for line in seen if line is not None]:
            yield json.dumps({"kind": "lines", "lines": news})
        if self.role.kind == INSTRUCTOR and session.given != self._given:
            self._given = session.given
            yield json.dumps({"kind": "given", "injects": session.given})
        if session.state_text != self._state and self._run == session.run_number:
            self._state = session.state_text
            yield self._state


MOST_PAGES = 40  # [1] open at a time
LONGEST_NAME = 40  # [1] letters of a person's name
KEPT = 2  # [1] of these for each role, which has them however many others are open
MOST_STRANGERS, OF_ONE_ADDRESS = 64, 16  # [1] that have not shown a token yet, in all and of one address
FIRST_WORD = 5.0  # [s] within which a page must show its token
MOST_COMMANDS = 40  # [1] that a page may give within a second
MOST_FAULTS = 20  # [1] messages that cannot be read, before a page is closed
CLOSED_TOKEN, CLOSED_MANY, CLOSED_FAULTS = 4401, 4429, 4400  # codes with which a page is closed
_HEADERS = {
    "content-security-policy": "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "connect-src 'self'; frame-src 'self' blob: {other}; frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cache-control": "no-store",
}


class PageServer:
    """Serves the pages of a session."""

    def __init__(self, access: Access, session: Session, *, hosts: list[str], viewer: WebViewer | None = None) -> None:
        """`hosts` are the names by which browsers may call this machine; `viewer`: the 3-D view, None without one."""
        self._access, self._session = access, session
        self._viewer = viewer
        self._pages: set[PageLink] = set()
        self._strangers = Places(MOST_STRANGERS, OF_ONE_ADDRESS)
        self._tasks: set[asyncio.Task[None]] = set()
        view = []
        if viewer is not None:
            view = [Route("/viewer/{name}", ViewerFiles(viewer.origin).answer), Route("/scene", self._scene)]
        page = files("scenarios.conduct").joinpath("page")
        self._folder = Path(str(page))
        self.application = Starlette(
            routes=[
                Route("/", self._start_page),
                Route("/debrief/{name}", self._debrief),
                Route("/what-if/{name}", self._what_if),
                WebSocketRoute("/live", self._live),
                Mount("/page", StaticFiles(directory=str(page))),
                *view,
            ],
            middleware=[Middleware(TrustedHostMiddleware, allowed_hosts=hosts), Middleware(_SecurityHeaders)],
        )

        self.application.router.redirect_slashes = False  # a path that is none is refused, not led elsewhere

    def notice(self) -> None:
        """Take note that the session has more to show."""
        for page in self._pages:
            page.notice()

    async def _start_page(self, _: Request) -> Response:
        return FileResponse(self._folder / "index.html", media_type="text/html")

    async def _scene(self, request: Request) -> Response:
        headers = policy(request.headers["host"])
        return FileResponse(self._folder / "scene.html", media_type="text/html", headers=headers)

    async def _debrief(self, request: Request) -> Response:
        """Return the debrief of a recording, to pages that show a token."""
        page = self._session.debriefs.get(request.path_params["name"])
        return self._refusal(request, page) or FileResponse(str(page), media_type="text/html")

    async def _what_if(self, request: Request) -> Response:
        """Return the comparison of a run with the one that people conducted, to pages that show a token."""
        found = self._session.what_ifs.get(request.path_params["name"])
        return self._refusal(request, found) or JSONResponse(found)

    def _refusal(self, request: Request, found: object | None) -> Response | None:
        """Return why a page is not given what was found: it shows no token, or nothing was found; None if it is."""
        token = request.headers.get("authorization", "").removeprefix("Bearer ")
        password = request.headers.get("x-password", "")
        if self._access.role_of(token, password, _address(request)) is None:
            return PlainTextResponse("the token opens nothing", status_code=401)
        return None if found is not None else PlainTextResponse("there is no such debrief", status_code=404)

    async def _live(self, socket: WebSocket) -> None:
        """Serve one page, from its token to its end."""
        if not _is_own(socket):
            await socket.close()  # before it is accepted: the browser gets 403
            return
        await socket.accept()
        with suppress(
            WebSocketDisconnect, TimeoutError, RuntimeError
        ):  # of one that gives way to a newer one, TimeoutError
            role = await self._introduced(socket)
            if role is None:
                await socket.close(CLOSED_TOKEN, "the token opens nothing")
            elif len(self._pages) >= MOST_PAGES and sum(page.role == role for page in self._pages) >= KEPT:
                await socket.close(CLOSED_MANY, f"{MOST_PAGES} pages are open, allowed: fewer")
            else:
                await self._serve(socket, role)

    async def _introduced(self, socket: WebSocket) -> Role | None:
        """Read a page's token; None if it opens nothing."""
        address, loop = _address(socket), asyncio.get_running_loop()
        try:
            async with asyncio.timeout(FIRST_WORD) as patience:
                self._strangers.enter(socket, address, lambda: patience.reschedule(loop.time()))
                data = read_message(await socket.receive_text())
        except (ScenarioError, KeyError):
            return None
        finally:
            self._strangers.leave(socket)
        return self._access.role_of(str(data.get("token", "")), str(data.get("password", "")), address)

    async def _serve(self, socket: WebSocket, role: Role) -> None:
        page = PageLink(socket, role, self._session)
        self._pages.add(page)
        sending = asyncio.create_task(page.send_all(self._hello(role, socket.headers["host"])))
        hearing = asyncio.create_task(self._hear(page))
        try:
            await asyncio.wait((sending, hearing), return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._pages.discard(page)
            for task in (sending, hearing):
                task.cancel()
            await asyncio.gather(sending, hearing, return_exceptions=True)
            with suppress(RuntimeError, WebSocketDisconnect):
                await socket.close()

    def _hello(self, role: Role, host: str) -> dict[str, Any]:
        """Return the first message to a page of a role that has called this machine `host`."""
        viewer = ""
        if self._viewer is not None:
            viewer = f"{other_origin(host)}/scene?{self._viewer.query}&page={quote(f'http://{host}', safe='')}"
        links = {one.name: token for one, token in self._access.tokens.items()} if role.kind == INSTRUCTOR else {}
        return {"kind": "hello", "role": role.kind, "vessel": role.vessel, "links": links, "viewer": viewer}

    async def _hear(self, page: PageLink) -> None:
        """Take a page's commands until it is closed, or has sent too much that cannot be read."""
        faults, second, count = 0, 0, 0
        loop = asyncio.get_running_loop()
        while faults < MOST_FAULTS:
            try:
                data = read_message(await page.socket.receive_text())
            except (ScenarioError, KeyError):
                faults += 1
                page.answer(0, problems=[["the message", "cannot be read, allowed: a command, as a JSON object"]])
                continue
            now = int(loop.time())
            second, count = (second, count + 1) if now == second else (now, 1)
            if count > MOST_COMMANDS:
                page.answer(0, problems=[["the page", f"gives more than {MOST_COMMANDS} commands a second"]])
                faults += 1
                continue
            self._begin(page, data)
        await page.socket.close(CLOSED_FAULTS, "too many messages that cannot be read")

    def _begin(self, page: PageLink, data: Mapping[str, Any]) -> None:
        """Say that a command has arrived, and do it meanwhile."""
        try:
            command = read_command(data)
        except ScenarioError as error:
            number = data.get("id")
            page.answer(number if isinstance(number, int) else 0, problems=_plain(error))
            return
        if command.verb == "look":
            page.answer(command.id, told="a state", state=self._session.album.nearest(float(command.entries["time"])))
            return
        page.answer(command.id, taken=True)
        if command.verb == "introduce":
            page.role = replace(page.role, person=str(command.entries["name"]).strip()[:LONGEST_NAME])
            page.answer(command.id, told=page.role.source)
            return

        async def work() -> None:
            try:
                page.answer(command.id, told=await self._session.do(command, page.role))
            except ScenarioError as error:
                page.answer(command.id, problems=_plain(error))
            except Exception as error:
                page.answer(command.id, problems=[[command.verb, f"failed: {error}"]])

        task = asyncio.create_task(work())
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)


class _SecurityHeaders:
    """Adds headers that keep other pages, scripts and servers out."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def answer(message: Message) -> None:
            if message["type"] == "http.response.start":
                own = {key for key, _ in message["headers"]}
                host = Headers(scope=scope).get("host", "")
                headers = [
                    (key.encode(), value.format(other=other_origin(host)).encode()) for key, value in _HEADERS.items()
                ]
                message["headers"] = [*message["headers"], *(pair for pair in headers if pair[0] not in own)]
            await send(message)

        await self._app(scope, receive, answer if scope["type"] == "http" else send)


def _address(connection: HTTPConnection) -> str:
    """Return the address that a connection comes from; empty if it is not known."""
    return "" if connection.client is None else connection.client.host


def _is_own(socket: WebSocket) -> bool:
    """Return whether a page comes from this server, by its origin."""
    origin, host = socket.headers.get("origin", ""), socket.headers.get("host", "")
    return bool(host) and secrets.compare_digest(origin.encode(), f"http://{host}".encode())


def _plain(error: ScenarioError) -> list[list[str]]:
    return [[problem.path, problem.text] for problem in error.problems]


@asynccontextmanager
async def running(session: Session) -> AsyncIterator[None]:
    """Start the session's run, and end it in order with the block."""
    session.start()
    try:
        yield
    finally:
        await asyncio.to_thread(session.close)
