"""Orders to a run from another program: `order`, `pause` and `go_on`; `oilsim order` calls them, and the console `ask`."""

from __future__ import annotations

import socket
from dataclasses import dataclass
from pathlib import Path

from recordings.model.frame import INSTRUCTOR
from scenarios.orders.protocol import LOOPBACK, Kind, Refused, RunCard, find_run, read_answer, request_line
from scenarios.text.problems import Problem, ScenarioError

PATIENCE = 60.0  # [s]; a step of a large run may take long


class NoAnswerError(Exception):
    """A run that did not answer: whether it has taken the order, its recording tells."""


@dataclass(frozen=True)
class Answer:
    """A run's answer: its simulated time [s], and the text of the event in its log."""

    time: float
    text: str


def order(run: str | Path, *settings: str, patience: float = PATIENCE) -> Answer:
    """Order changes in a run that goes on, all of them or none; return when they act.

    Args:
        run: the run's recording, or its name if no other run has it.
        settings: as for ``--set``, for example ``"tow.speed_kn=0.5"``.
        patience: time [s] to wait for the answer.

    Raises ScenarioError if there is no such run, or with every reason why nothing was changed; NoAnswerError without an answer.
    """
    return ask(run, "order", settings, patience)


def pause(run: str | Path, *, patience: float = PATIENCE) -> Answer:
    """Let a run wait at its next communication point; it still takes orders there. Arguments and errors as those of `order`."""
    return ask(run, "pause", (), patience)


def go_on(run: str | Path, *, patience: float = PATIENCE) -> Answer:
    """Let a run that was paused go on. Arguments and errors as those of `order`."""
    return ask(run, "go-on", (), patience)


def ask(
    run: str | Path, kind: Kind, settings: tuple[str, ...] = (), patience: float = PATIENCE, by: str = INSTRUCTOR
) -> Answer:
    """Send one request of a kind with its words, and wait for its answer up to `patience` [s]; `by` is who asks, as the log names it.

    Raises ScenarioError and NoAnswerError as `order` does.
    """
    try:
        card = find_run(run)
        line = _exchanged(card, request_line(kind, settings, card.token, by), patience)
        return Answer(*read_answer(line))
    except Refused as refusal:
        raise ScenarioError(refusal.problems, "oilsim") from None
    except ScenarioError:
        raise
    except TimeoutError:
        raise NoAnswerError(
            f"{run} has not answered within {patience:g} s; it takes the request at its next communication point"
        ) from None
    except PermissionError as error:
        raise ScenarioError([Problem("RUN", f"cannot be reached: {error}")], "oilsim") from error
    except (OSError, ValueError) as error:
        raise NoAnswerError(f"{run} has not answered: {error}") from error


def _exchanged(card: RunCard, line: bytes, patience: float) -> bytes:
    """Send a line, and return the line that comes back."""
    path, port = (card.address, 0) if isinstance(card.address, str) else ("", card.address)
    with socket.socket(socket.AF_UNIX if path else socket.AF_INET, socket.SOCK_STREAM) as link:
        link.settimeout(patience)
        link.connect(path or (LOOPBACK, port))
        link.sendall(line)
        with link.makefile("rb") as answers:
            answer = answers.readline()
    if not answer.endswith(b"\n"):
        raise ValueError("it has ended")
    return answer
