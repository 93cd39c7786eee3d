"""An FMU in a process of its own, as a participant: one that crashes or never comes back ends its run in order, and is named.

Parent and child speak by pickled messages over pipes: a verb of `FmuParticipant` and its arguments one way, what came of it the other.
What the child says is trusted as far as the FMU is, whose binary could do in this process what it likes.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import select
import signal
import subprocess
import sys
import tempfile
import time as wall_clock
import weakref
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy.typing as npt

from coupling.fmu.fmu_participant import FmuParticipant
from coupling.fmu.trial_process import STOPPING, is_own_process, temporary_folder
from coupling.master.participant import Participant, StepResult, Variable
from oilsim.backend.arrays import Array
from recordings.files.writing import module_command, module_environment

STEP_PATIENCE = 60.0  # s that one call may take: far above a step of any model, and short enough to be waited for
START_PATIENCE = 120.0  # s for what comes before the first step, in which an exercise builds its fluid
GRACE = 5.0  # s that a call has left once the run was asked to stop
_SLICE = 0.05  # s between looks at whether it was
_KINDS = (ValueError, TypeError, NotImplementedError)
_ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in ("OPENBLAS", "OMP", "MKL")}


class _Held:
    """Stands for a state that only the FMU's process can hold."""

    def __init__(self, number: int) -> None:
        self.number = number


class IsolatedFmu(Participant):
    """A participant that runs one FMU in a process of its own, which is started when the run begins; else the same as `FmuParticipant`.

    Every call that reaches the FMU raises the ValueError, TypeError or NotImplementedError of `FmuParticipant`, and RuntimeError if the
    FMU fails, its process crashes or has not been started, or the answer does not come within `step_patience` (before the first step
    `START_PATIENCE`).
    """

    def __init__(
        self,
        name: str,
        path: str | Path,
        start_values: Mapping[str, npt.ArrayLike] | None = None,
        units: Mapping[str, str] | None = None,
        *,
        step_patience: float = STEP_PATIENCE,
    ) -> None:
        """Read the FMU's model description and raise the errors of `FmuParticipant`; no process is started yet.

        step_patience [s]: wall time that one call may take from the first step on.
        """
        self._here = FmuParticipant(name, path, start_values, units)  # for what is known without running it
        self._file = Path(path).name
        self._arguments = (name, str(Path(path).resolve()), dict(start_values or {}), dict(units or {}))
        self._why_not_kept = self._here.why_not_kept
        self._step_size: float | None = None
        self._patience = step_patience
        self._child: subprocess.Popen[bytes] | None = None
        self._dropped: list[int] = []  # states that nobody can restore any more
        self.name = name
        self.variables: Mapping[str, Variable] = self._here.variables
        self.only_one_of = ""  # each has a process of its own
        self.other_names = self._here.other_names
        self.rehearse = self._here.rehearse

    @property
    def why_not_kept(self) -> str:
        """Reason why the FMU's state cannot be kept outside its process as bytes; empty if it can. See `FmuParticipant.why_not_kept`."""
        return self._why_not_kept

    @property
    def process_id(self) -> int | None:
        """Number of the FMU's process; None while it has none."""
        return None if self._child is None else self._child.pid

    def expect_step(self, step_size: float) -> None:
        """Prepare for whole steps of `step_size` [s]: the FMU is told so when its process starts."""
        self._step_size = step_size

    def enter_initialization_mode(self, start_time: float) -> None:
        """Start the process, and in it the FMU."""
        self._start()
        self._ask("enter_initialization_mode", start_time, patience=START_PATIENCE)

    def exit_initialization_mode(self) -> None:
        """Finish the initialization: the initial inputs are set, and steps follow."""
        self._ask("exit_initialization_mode", patience=START_PATIENCE)

    def get(self, name: str) -> Array:
        """Return a copy of the variable `name`, an array of its shape, as (6,), in its unit, as [N, N m]; ValueError for another name."""
        value: Array = self._ask("get", name)
        return value

    def set(self, name: str, value: Array) -> None:
        """Set an input, or a parameter before the run, to `value`, an array of its shape, as (6,), in its unit, as [N, N m].

        Raises ValueError for an output, an unknown name and another shape.
        """
        self._ask("set", name, value)

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Make one step from `time` to `time + step_size` [s]; RuntimeError for an FMU that crashes or does not come back in it."""
        result: StepResult = self._ask("do_step", time, step_size)
        return result

    def save_state(self) -> object:
        """Return the FMU's state: bytes if it can be serialised, else a reference to a state that stays in the FMU's process.

        The process drops such a state once nothing refers to it. Raises NotImplementedError if the FMU cannot save its state.
        """
        state = self._ask("save_state")
        if isinstance(state, _Held):
            weakref.finalize(state, self._dropped.append, state.number)
        return state

    def restore_state(self, state: object) -> None:
        """Go back to a state that `save_state` returned in this run, or as bytes in any; TypeError for another kind of object."""
        self._ask("restore_state", state)

    def terminate(self) -> None:
        """End the FMU and its process, whatever becomes of either."""
        if self._child is None:
            return
        try:
            self._ask("terminate")
        finally:
            self._end()

    def _start(self) -> None:
        folder = temporary_folder("fmu")
        self._child = subprocess.Popen(
            module_command(__name__),
            env=module_environment() | _ONE_THREAD | {"TMPDIR": folder.name},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,  # Ctrl-C is for the run
        )
        self._release = weakref.finalize(self, _release, self._child, folder)
        self._say((self._arguments, self._step_size))

    def _ask(self, verb: str, *arguments: object, patience: float | None = None) -> Any:
        """Have the process do something; RuntimeError if it crashes or does not come back, else what the FMU's own call raised."""
        if self._child is None:
            allowed = "between enter_initialization_mode and terminate"
            raise RuntimeError(f"{self.name!r} is not running, allowed: {allowed}")
        dropped, self._dropped[:] = list(self._dropped), []
        self._say((verb, arguments, dropped))
        self._wait(verb, self._patience if patience is None else patience)
        assert self._child.stdout is not None  # a pipe was asked for
        try:
            failure, value, self._why_not_kept = pickle.load(self._child.stdout)
        except (EOFError, pickle.UnpicklingError) as error:
            raise self._crashed(verb) from error
        if failure is not None:
            raise next((kind for kind in _KINDS if kind.__name__ == failure), RuntimeError)(value)
        return value

    def _say(self, message: object) -> None:
        assert self._child is not None and self._child.stdin is not None
        try:
            pickle.dump(message, self._child.stdin, protocol=pickle.HIGHEST_PROTOCOL)
            self._child.stdin.flush()
        except BrokenPipeError as error:
            raise self._crashed("call") from error

    def _wait(self, verb: str, patience: float) -> None:
        """Until there is an answer, or the end of patience; that is short once the run was asked to stop."""
        assert self._child is not None and self._child.stdout is not None
        deadline = wall_clock.monotonic() + patience
        is_hurried = False
        while not select.select([self._child.stdout], [], [], _SLICE)[0]:
            if STOPPING.is_set() and not is_hurried:
                is_hurried, deadline = True, min(deadline, wall_clock.monotonic() + GRACE)
            if wall_clock.monotonic() > deadline:
                self._end()
                why = f"{GRACE:g} s after the run was asked to stop" if is_hurried else f"{patience:g} s"
                raise RuntimeError(f"{self._file} does not come back from {verb} within {why}")

    def _crashed(self, verb: str) -> RuntimeError:
        child = self._child
        self._end()
        code = 0 if child is None or child.returncode is None else child.returncode
        how = f"crashes in {verb} ({signal.Signals(-code).name})" if code < 0 else f"ends its process in {verb}"
        return RuntimeError(f"{self._file} {how}")

    def _end(self) -> None:
        """Let the process end by itself if it does so at once, and remove what it has unpacked."""
        child, self._child = self._child, None
        if child is None:
            return
        _close_pipes(child)
        with contextlib.suppress(subprocess.TimeoutExpired):
            child.wait(GRACE if child.poll() is None and not STOPPING.is_set() else 0.1)
        self._release()


def _close_pipes(child: subprocess.Popen[bytes]) -> None:
    for pipe in (child.stdin, child.stdout):
        if pipe is not None:
            with contextlib.suppress(BrokenPipeError):
                pipe.close()


def _release(child: subprocess.Popen[bytes], folder: tempfile.TemporaryDirectory[str]) -> None:
    """End the process of an FMU, and close its pipes and remove its folder, also where nobody has ended the FMU."""
    child.kill()
    child.wait()
    _close_pipes(child)
    folder.cleanup()


Fmu = IsolatedFmu | FmuParticipant


def fmu(
    name: str,
    path: str | Path,
    start_values: Mapping[str, npt.ArrayLike] | None = None,
    units: Mapping[str, str] | None = None,
) -> Fmu:
    """Create the participant of an FMU: with a process of its own if this Python can start one, else in this process.

    A program that embeds Python cannot start one. Arguments and errors are those of `FmuParticipant`: a start value is a number, or an
    array of its variable's shape, as (6,), in its unit, as [N].
    """
    kind = IsolatedFmu if is_own_process() else FmuParticipant
    return kind(name, path, start_values, units)


def _serve(questions: IO[bytes], answers: IO[bytes]) -> None:
    """The child: one FMU, and one question after another until there are no more."""
    arguments, step_size = pickle.load(questions)
    own = FmuParticipant(*arguments)
    if step_size is not None:
        own.expect_step(step_size)
    held: dict[int, object] = {}
    number = 0
    while True:
        try:
            verb, given, dropped = pickle.load(questions)
        except EOFError:
            break
        for one in dropped:
            held.pop(one, None)
        failure = None
        try:
            value = getattr(own, verb)(*(held[one.number] if isinstance(one, _Held) else one for one in given))
        except Exception as error:
            failure, value = type(error).__name__, str(error)
        if verb == "save_state" and failure is None and not isinstance(value, bytes):
            number += 1
            held[number], value = value, _Held(number)
        pickle.dump((failure, value, own.why_not_kept), answers, protocol=pickle.HIGHEST_PROTOCOL)
        answers.flush()


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    private = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what an FMU prints is no answer
    from coupling.fmu import isolated_fmu  # whose classes the parent knows by this name, not by __main__

    isolated_fmu._serve(sys.stdin.buffer, private)
    os._exit(0)  # without Python's end, in which binaries of Python FMUs now and then find the heap corrupted
