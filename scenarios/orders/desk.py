"""The order desk of a run: a local socket that only its user may open, and the requests that wait for the run.

A thread of its own reads the requests; the run takes them from a short queue when it has time, at a communication point. So no sender,
however slow, loud or wrong, makes the run wait.
"""

from __future__ import annotations

import asyncio
import queue
import secrets
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from scenarios.orders.protocol import (
    LONGEST,
    LOOPBACK,
    Refused,
    Request,
    RunCard,
    new_socket_path,
    posted,
    read_request,
    refusal_line,
    runtime_folder,
    too_long,
)
from scenarios.text.problems import Problem

MOST_SENDERS = 16
MOST_WAITING = 8
SLOWEST = 5.0  # [s] that a sender may take over its request, and over reading the answer


class OrderDesk:
    """The requests to one run; `open_desk` makes one."""

    def __init__(self, token: str) -> None:
        self._token = token
        self._waiting: queue.Queue[Request] = queue.Queue(MOST_WAITING)
        self._senders = 0
        self._is_open = True

    @property
    def requests(self) -> Iterator[Request]:
        """The requests that wait, at most `MOST_WAITING`, which are taken one by one."""
        for _ in range(MOST_WAITING):
            if (request := self.take()) is None:
                return
            yield request

    def take(self, patience: float = 0.0) -> Request | None:
        """Return the next request, for which the caller waits up to `patience` [s]; None if there is none."""
        try:
            return self._waiting.get(block=patience > 0.0, timeout=patience or None)
        except queue.Empty:
            return None

    def shut(self) -> None:
        """Take no more requests, and refuse those that wait."""
        self._is_open = False
        while (request := self.take()) is not None:
            request.refused([_ended()])

    async def meet(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Take the one request of a sender, and pass on the answer when the run gives it."""
        self._senders += 1
        try:
            with suppress(OSError, TimeoutError, asyncio.CancelledError):  # cancelled as the run ends
                writer.write(await self._heard(reader))
                async with asyncio.timeout(SLOWEST):
                    await writer.drain()
        finally:
            self._senders -= 1
            writer.close()

    async def _heard(self, reader: asyncio.StreamReader) -> bytes:
        """Return the answer to a sender."""
        try:
            if self._senders > MOST_SENDERS:
                raise Refused(Problem("the run", f"has {MOST_SENDERS} senders of orders now, allowed: fewer at a time"))
            request = read_request(await _line_of(reader), self._token)
            if not self._is_open:
                raise Refused(_ended())
            self._waiting.put_nowait(request)
        except Refused as refusal:
            return refusal_line(refusal.problems)
        except queue.Full:
            return refusal_line(
                [Problem("the run", f"has {MOST_WAITING} requests waiting, allowed: after it has answered them")]
            )
        return await asyncio.wrap_future(request.answer)


async def _line_of(reader: asyncio.StreamReader) -> bytes:
    """Read a sender's line; Refused if it is too long or does not come."""
    try:
        async with asyncio.timeout(SLOWEST):
            return await reader.readline()
    except TimeoutError:
        raise Refused(Problem("the request", f"did not come within {SLOWEST:g} s, allowed: one line at once")) from None
    except ValueError:
        raise too_long() from None


def _ended() -> Problem:
    return Problem("the run", "has ended, allowed: orders while it runs")


@contextmanager
def open_desk(name: str, recording: Path | None) -> Iterator[OrderDesk]:
    """Take requests to the run of a scenario within the block; OSError if there is no place for the socket."""
    folder = runtime_folder()
    token = secrets.token_hex(16)
    with _listening(folder) as (listener, address):
        whole = "" if recording is None else str(recording.resolve())
        card = RunCard(name=name, recording=whole, address=address, token=token)
        desk = OrderDesk(token)
        with _served(desk, listener), posted(card, folder):
            yield desk


@contextmanager
def _listening(folder: Path) -> Iterator[tuple[socket.socket, str | int]]:
    """Open a socket in the folder, or where there are no such sockets a port of this machine only; yield it with its address."""
    path = new_socket_path(folder)
    try:
        listener = _listener_at(path) or socket.create_server((LOOPBACK, 0))
        with listener:
            yield listener, str(path) if path.exists() else int(listener.getsockname()[1])
    finally:
        path.unlink(missing_ok=True)


def _listener_at(path: Path) -> socket.socket | None:
    """Open a socket at a path, for its user only; None where that cannot be."""
    if not hasattr(socket, "AF_UNIX"):
        return None
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        listener.bind(str(path))
        path.chmod(0o600)
        listener.listen()
    except OSError:  # the path is too long, or its drive has no sockets
        listener.close()
        path.unlink(missing_ok=True)
        return None
    return listener


@contextmanager
def _served(desk: OrderDesk, listener: socket.socket) -> Iterator[None]:
    """Serve senders in a thread within the block."""
    loop = asyncio.new_event_loop()
    end = asyncio.Event()
    thread = threading.Thread(target=loop.run_until_complete, args=(_serve(desk, listener, end),), daemon=True)
    thread.start()
    try:
        yield
    finally:
        desk.shut()
        loop.call_soon_threadsafe(end.set)
        thread.join()
        loop.close()


async def _serve(desk: OrderDesk, listener: socket.socket, end: asyncio.Event) -> None:
    """Serve senders until told to end; those that have an answer get it, the others are left."""
    server = await (
        asyncio.start_server(desk.meet, sock=listener, limit=LONGEST)
        if listener.family == socket.AF_INET
        else asyncio.start_unix_server(desk.meet, sock=listener, limit=LONGEST)
    )
    await end.wait()
    server.close()
    desk.shut()  # what came since
    own = asyncio.current_task()
    left = [task for task in asyncio.all_tasks() if task is not own]
    if left:
        _, late = await asyncio.wait(left, timeout=0.5)
        for task in late:
            task.cancel()
        await asyncio.gather(*late, return_exceptions=True)
