"""An FMU for co-simulation, FMI 2 or 3, as a participant.

Its inputs, outputs and parameters keep their names. A number is an array of shape (1,), so that it connects to a joint's tension. The
elements of an FMI 2 array, named `wrench[1]` to `wrench[6]`, also form one variable `wrench` of shape (6,). An FMI 3 array has its own
shape. Variables are in their units of the model description (`coupling.fmu.variables`). Integers, enumerations and booleans are numbers.
"""

from __future__ import annotations

import math
import os
import sys
import tempfile
import weakref
from collections.abc import Callable, Mapping, Sequence
from contextlib import chdir
from dataclasses import dataclass, replace
from pathlib import Path

import fmpy
import numpy as np
import numpy.typing as npt
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2LastSuccessfulTime, fmi2Terminated
from fmpy.fmi3 import FMU3Slave
from fmpy.model_description import ModelVariable

from coupling.fmu.participant_slave import ENDED
from coupling.fmu.trial_process import is_own_process, suspected_folder, temporary_folder, try_out
from coupling.fmu.variables import FLOATS, FmuMessages, grouped, read_description, variables_of, whole
from coupling.master.participant import Causality, Participant, Status, StepResult, checked_value
from oilsim.backend.arrays import Array

DISCARD_STATUS, FATAL_STATUS = 2, 4  # of FMI 2 and 3
ROUNDING = 1e-6  # relative, of a step that is the difference of two times


@dataclass(eq=False)
class _Held:
    """A saved state that the FMU itself holds."""

    handle: object


class FmuParticipant(Participant):
    """Runs one FMU, which is unpacked when the run begins and removed when it ends.

    Raises ValueError for start values that are unknown to the FMU or not finite, and for units that the FMU states itself.
    """

    def __init__(
        self,
        name: str,
        path: str | Path,
        start_values: Mapping[str, npt.ArrayLike] | None = None,
        units: Mapping[str, str] | None = None,
    ) -> None:
        """Read the FMU's model description.

        start_values: parameters and initial inputs by name; a number counts for every element of an array. units: units by the names of
        variables for which the FMU states none. Raises FileNotFoundError for a missing file, and ValueError, with every problem at once,
        for a file that is no FMU, has no co-simulation or no binary for this platform.
        """
        self.name = name
        self._path = Path(path)
        self._description = read_description(self._path)
        self._members = grouped(self._description)
        self.variables = variables_of(self._description, self._members, units or {})
        self._start_values = {
            key: checked_value(name, self.variables, key, _filled(value, self.variables[key].shape))
            for key, value in self._checked_start_values(start_values or {}).items()
        }
        for key, start in self._start_values.items():
            self._numbers(key, start)
            if not np.isfinite(start).all():
                raise ValueError(f"{name!r}: {key!r} is {start[~np.isfinite(start)][0]:g}, allowed: finite numbers")
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._fmu: FMU2Slave | FMU3Slave | None = None
        self._is_initialized = False
        self._held: list[tuple[weakref.ref[_Held], object]] = []  # states, with what the FMU holds of each
        self._messages = FmuMessages()
        interface = self._description.coSimulation
        self._even_step: float | None = None  # of an FMU that wants one number, to the last bit (FMI 2.0.4, 4.2.1)
        self._why_not_saved = "" if interface.canGetAndSetFMUstate else "it lacks canGetAndSetFMUState"
        self._why_not_serialised = "" if interface.canSerializeFMUstate else "it lacks canSerializeFMUState"

    @property
    def why_not_kept(self) -> str:
        """Reason why the FMU's state cannot be kept outside it as bytes, as checkpoints need it; empty if it can.

        Before the initialization the FMU's own statement counts, and afterwards the result of a trial.
        """
        return self._why_not_serialised or self._why_not_saved

    @property
    def only_one_of(self) -> str:
        """Identifier (GUID) of an FMU that may be instantiated only once in a process; empty if a process may hold several instances."""
        description = self._description
        return str(description.guid) if description.coSimulation.canBeInstantiatedOnlyOncePerProcess else ""

    @property
    def other_names(self) -> Mapping[str, str]:
        """Further names of variables (FMI 3, section 2.4.7), with the name that each stands for."""
        return {one.name: one.alias.name for one in self._description.modelVariables if one.alias is not None}

    def expect_step(self, step_size: float) -> None:
        """Prepare for whole steps of `step_size` [s]: an FMU that cannot vary its step is given exactly this number."""
        if not self._description.coSimulation.canHandleVariableCommunicationStepSize:
            self._even_step = step_size

    def rehearse(self) -> None:
        """Load the FMU, create an instance and free it, to find out before a run whether it works; ValueError if it does not.

        The trial runs in a separate process if one can be started, since a broken FMU may crash or hang its process.
        """
        arguments = (self.name, str(self._path.resolve()))
        problem = try_out(__name__, arguments) if is_own_process() else self.load_and_free()
        if problem:
            raise ValueError(f"FMU {self._path} cannot be loaded: {problem}{suspected_folder()}")

    def load_and_free(self) -> str:
        """Load the FMU, create an instance and free it; return a description of the failure, empty if there is none."""
        try:
            self._instantiate().freeInstance()
        except Exception as cause:
            return self._messages.explain(cause)
        finally:
            self._forget()
        return ""

    def enter_initialization_mode(self, start_time: float) -> None:
        """Unpack, instantiate, set start values, and compute initial outputs."""
        try:
            fmu = self._instantiate()
            if isinstance(fmu, FMU2Slave):
                fmu.setupExperiment(startTime=start_time)
            for key, value in self._start_values.items():
                self._write(key, value)
            if isinstance(fmu, FMU3Slave):
                fmu.enterInitializationMode(startTime=start_time)
            else:
                fmu.enterInitializationMode()
        except Exception as cause:
            raise self._failure(cause) from cause

    def _instantiate(self) -> FMU2Slave | FMU3Slave:
        """Create a new instance, unpacked into a folder of its own."""
        description = self._description
        self._folder = temporary_folder("fmu")
        weakref.finalize(self, self._folder.cleanup)  # of a participant that nobody has ended
        fmpy.extract(str(self._path), self._folder.name)
        kind = FMU2Slave if description.fmiVersion.startswith("2") else FMU3Slave
        with chdir(Path.cwd()):  # FMPy goes to the binary's folder, and stays there if it cannot load it
            fmu = kind(
                guid=description.guid,
                unzipDirectory=self._folder.name,
                modelIdentifier=description.coSimulation.modelIdentifier,
                instanceName=self.name,
            )
        if isinstance(fmu, FMU3Slave):
            fmu.instantiate(earlyReturnAllowed=True, loggingOn=True, logMessage=self._messages.listener)
        else:
            fmu.instantiate(callbacks=self._messages.callbacks, loggingOn=True)
        self._fmu = fmu
        return fmu

    def exit_initialization_mode(self) -> None:
        """Finish the initialization, and try whether the FMU can save its state."""
        try:
            self._running().exitInitializationMode()
        except FMICallException as cause:
            raise self._failure(cause) from cause
        self._is_initialized = True
        if not self._why_not_saved:
            self._try_state()

    def _try_state(self) -> None:
        """Find out whether the FMU can save its state: some only state that they can, and a run does not need it."""
        fmu, handle = self._running(), None
        try:
            handle = fmu.getFMUState()
            if not self._why_not_serialised:
                fmu.serializeFMUState(handle)
        except FMICallException as cause:
            if cause.status == FATAL_STATUS:
                raise self._failure(cause) from cause
            if handle is None:
                self._why_not_saved = self._messages.explain(cause).rstrip(".")
            else:
                self._why_not_serialised = self._messages.explain(cause).rstrip(".")
        if handle is not None:
            fmu.freeFMUState(handle)

    def get(self, name: str) -> Array:
        """Return a copy of a variable; ValueError for a name that is no variable."""
        if name not in self.variables:
            raise ValueError(f"{self.name!r} has no variable {name!r}, allowed: {', '.join(self.variables)}")
        members = self._members[name]
        read = getattr(self._running(), f"get{self._kind(members[0])}")
        try:
            values = read([member.valueReference for member in members], **self._count(name))
        except FMICallException as cause:
            raise self._failure(cause) from cause
        return np.array(values, dtype=np.float64).reshape(self.variables[name].shape)

    def set(self, name: str, value: Array) -> None:
        """Set an input, or a parameter before the run; ValueError for an output, an unknown name and another shape."""
        self._write(name, checked_value(self.name, self.variables, name, value))

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Make one `doStep`; the result passes on an early return, a discard and a request to end the run.

        After a discard, FMI 2 allows only steps from an earlier state. So the state of an FMI 2 FMU is saved before each step, and restored
        after a discard.
        """
        fmu, end = self._running(), time + step_size
        if self._even_step is not None and math.isclose(step_size, self._even_step, rel_tol=ROUNDING):
            step_size = self._even_step
        before = fmu.getFMUState() if isinstance(fmu, FMU2Slave) and not self._why_not_saved else None
        try:
            result = fmu.doStep(time, step_size, False)  # whoever drives it may go back to before this step
        except FMICallException as failure:
            if failure.status == DISCARD_STATUS:
                return self._discarded(time, step_size, self._messages.explain(failure), before)
            self._forget()  # the standard forbids any further call after a fatal error
            return StepResult(Status.ERROR, time, self._messages.explain(failure))
        finally:
            if before is not None and self._fmu is not None:
                fmu.freeFMUState(before)
        if result is None:
            return StepResult(Status.OK, end)
        _, wants_end, is_early, reached = result
        if wants_end:
            return self._ended(reached)
        return StepResult(Status.EARLY_RETURN if is_early else Status.OK, reached if is_early else end)

    def _discarded(self, time: float, step_size: float, message: str, before: object | None) -> StepResult:
        """Handle a discard: restore the state `before`, and step to the time that the FMU says it could reach, if any."""
        fmu = self._running()
        if isinstance(fmu, FMU3Slave):  # which leaves its state as it was
            return StepResult(Status.DISCARD, time, message)
        reached = float(self._status(fmu.getRealStatus, fmi2LastSuccessfulTime, time))
        wants_end = self._status(fmu.getBooleanStatus, fmi2Terminated, False)
        if wants_end and (ENDED in message or not self._confuses_discard_with_end):
            return self._ended(reached)
        if before is None:
            self._forget()
            return StepResult(
                Status.ERROR, time, f"{message}; {self._path.name} cannot be rolled back for a shorter step"
            )
        fmu.setFMUState(before)
        if not time < reached < time + step_size:
            return StepResult(Status.DISCARD, time, message)
        shorter = self.do_step(time, reached - time)
        return replace(shorter, status=Status.EARLY_RETURN) if shorter.status is Status.OK else shorter

    def _status(self, read: Callable[[int], float], kind: int, unknown: float) -> float:
        """Read a status of a discarded step in FMI 2; `unknown` if the FMU does not give it."""
        try:
            return read(kind)
        except FMICallException as cause:
            if cause.status == DISCARD_STATUS:
                return unknown
            raise self._failure(cause) from cause

    def _ended(self, reached: float) -> StepResult:
        text = f"{self._path.name} asked to end the run"
        return StepResult(Status.EARLY_RETURN, reached, text, terminate_simulation=True)

    @property
    def _confuses_discard_with_end(self) -> bool:
        """True if the FMU reports fmi2Terminated after every discard, as PythonFMU's binary (0.7) does."""
        return "PythonFMU" in (self._description.generationTool or "")

    def save_state(self) -> object:
        """Return the FMU's state: bytes if it can be serialised, else a reference to a state that the FMU holds until the run ends.

        The FMU frees such a state once nothing refers to it. Raises NotImplementedError if the FMU cannot save its state.
        """
        if self._why_not_saved:
            raise NotImplementedError(f"{self.name!r}: {self._path.name} cannot save its state ({self._why_not_saved})")
        fmu = self._running()
        handle = fmu.getFMUState()
        if self._why_not_serialised:
            self._free_dropped()
            held = _Held(handle)
            self._held.append((weakref.ref(held), handle))
            return held
        try:
            return bytes(fmu.serializeFMUState(handle))
        finally:
            fmu.freeFMUState(handle)

    def restore_state(self, state: object) -> None:
        """Go back to a state that `save_state` returned in this run, or as bytes in any; TypeError for anything else."""
        fmu = self._running()
        if isinstance(state, _Held) and any(held() is state for held, _ in self._held):
            fmu.setFMUState(state.handle)
            return
        if not isinstance(state, bytes):
            raise TypeError(f"{self.name!r}: restore_state wants what save_state returned, not {type(state).__name__}")
        handle = fmu.deserializeFMUState(state)
        try:
            fmu.setFMUState(handle)
        finally:
            fmu.freeFMUState(handle)

    def terminate(self) -> None:
        """Terminate and free the instance, and remove the unpacked files."""
        try:
            if self._fmu is not None:
                for _, handle in self._held:
                    self._fmu.freeFMUState(handle)
                if self._is_initialized:
                    self._fmu.terminate()
                self._fmu.freeInstance()
        finally:
            self._forget()

    def _failure(self, cause: Exception) -> RuntimeError:
        """Turn a failure into a RuntimeError with the FMU's messages.

        After an FMI error, a discard excepted, the instance is forgotten, since the standard allows no useful call any more.
        """
        if isinstance(cause, FMICallException) and cause.status != DISCARD_STATUS:
            self._forget()
        return cause if isinstance(cause, RuntimeError) else RuntimeError(self._messages.explain(cause))

    def _forget(self) -> None:
        """Forget the instance without a further call to it, and remove the unpacked files."""
        if self._folder is not None:
            self._folder.cleanup()
        self._fmu, self._folder, self._is_initialized = None, None, False
        self._held.clear()

    def _free_dropped(self) -> None:
        """Free states in the FMU that cannot be restored any more, because nothing refers to them."""
        dropped = [handle for held, handle in self._held if held() is None]
        self._held = [(held, handle) for held, handle in self._held if held() is not None]
        for handle in dropped:
            self._running().freeFMUState(handle)

    def _running(self) -> FMU2Slave | FMU3Slave:
        if self._fmu is None:
            raise RuntimeError(
                f"{self.name!r} is not running, allowed: between enter_initialization_mode and terminate"
            )
        return self._fmu

    def _count(self, name: str) -> dict[str, int]:
        """Return the number of values of a variable as an argument, which only calls of FMI 3 need."""
        is_three = isinstance(self._fmu, FMU3Slave)
        return {"nValues": int(np.prod(self.variables[name].shape))} if is_three else {}

    def _kind(self, variable: ModelVariable) -> str:
        """Return the type that follows `get` and `set` in the names of FMI calls; an enumeration is read and written as an integer."""
        if variable.type == "Enumeration":
            return "Integer" if self._description.fmiVersion.startswith("2") else "Int64"
        return str(variable.type)

    def _write(self, name: str, value: Array) -> None:
        members = self._members[name]
        write = getattr(self._running(), f"set{self._kind(members[0])}")
        numbers = self._numbers(name, value)
        try:
            write([member.valueReference for member in members], numbers)
        except FMICallException as cause:
            raise self._failure(cause) from cause

    def _numbers(self, name: str, value: Array) -> Sequence[float]:
        """Convert a value to numbers of the FMU's type; ValueError for values that the type cannot hold."""
        kind = self._kind(self._members[name][0])
        numbers: list[float] = value.ravel().tolist()
        return numbers if kind in FLOATS else whole(f"{self.name!r}: {name!r}", kind, numbers)

    def _checked_start_values(self, start_values: Mapping[str, npt.ArrayLike]) -> Mapping[str, npt.ArrayLike]:
        allowed = [key for key, variable in self.variables.items() if variable.causality is not Causality.OUTPUT]
        problems = [
            f"{self.name!r} has no parameter or input {key!r}, allowed: {', '.join(allowed) or 'none'}"
            for key in start_values
            if key not in allowed
        ]
        if problems:
            raise ValueError("; ".join(problems))
        return start_values


def _filled(value: npt.ArrayLike, shape: tuple[int, ...]) -> Array:
    """Return an array of a shape that is full of one number; several numbers, as (2,), stay as they are [any unit]."""
    numbers = np.asarray(value, dtype=np.float64)
    return np.full(shape, numbers) if numbers.ndim == 0 else numbers


if __name__ == "__main__":  # the rehearsal: NAME FILE
    problem = FmuParticipant(sys.argv[1], sys.argv[2]).load_and_free()
    print(problem, end="", file=sys.stderr, flush=True)
    # without Python's end, in which binaries of Python FMUs now and then find the heap corrupted: a run does not ask for that
    os._exit(1 if problem else 0)
