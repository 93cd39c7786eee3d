"""Checkpoints of runs: when they are written, where they are, from which one a run continues, and their contents.

The checkpoints of ``sweep.rrd`` are in the folder ``sweep.checkpoints``, one file for each. An instructor may go back to any of them,
and to any time after the first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coupling.master.co_simulation import CoSimulation
from coupling.master.saved_fields import require_alike
from recordings.files.checkpoint import Checkpoint, CheckpointError, load_checkpoint, save_checkpoint, state_hash
from recordings.files.writing import RECORDING_ENDING, RecordingError, absence, held
from scenarios.running.assembly import Assembly
from scenarios.running.output_paths import CHECKPOINTS_ENDING, checkpoint_folder
from scenarios.running.plan import Plan, plan_from, replayed_after, with_given_orders
from scenarios.spec.resolve import resolve
from scenarios.text.problems import Problem, ScenarioError
from scenarios.text.versions import versions

if TYPE_CHECKING:
    from recordings.replay.recording import Replay

ENDING = ".npz"
# [1] checkpoints of a run that nobody asked for; chosen; of 1 to 100 MB each
KEPT = 100
_NUMERIC = ("oilsim", "numpy", "numba", "pybullet")  # versions on which the bits depend


def run_state(simulation: CoSimulation, assembly: Assembly) -> dict[str, Any]:
    """Return everything that influences the next step, and the accounts that are kept."""
    return {"simulation": simulation.save_state(), **assembly.save_state()}


def begin_from(state: Mapping[str, Any], simulation: CoSimulation, assembly: Assembly) -> None:
    """Initialize a run that has not begun at a state from `run_state`."""
    for name, account in assembly.account_states().items():
        require_alike(name, state[name], account)
    assembly.restore_state(state)
    simulation.initialize(state["simulation"])


@contextmanager
def fitting(source: Path) -> Iterator[None]:
    """Turn errors within the block, where a run takes its state from the checkpoint `source`, into a CheckpointError that names it."""
    try:
        yield
    except (ValueError, TypeError, LookupError, AttributeError, ArithmeticError) as error:
        told = f"it has no entry {error}" if isinstance(error, KeyError) else str(error)
        raise CheckpointError(source, f"does not fit the run that it names: {told}") from error


def run_state_hash(simulation: CoSimulation, assembly: Assembly) -> str:
    """Compute a hash of a run's state that is equal for states that are equal bit for bit."""
    return state_hash(run_state(simulation, assembly))


class CheckpointWriter:
    """The writer of one run's checkpoints, into a folder of their own; it thins them out if they become too many.

    Then every second checkpoint is deleted, and the interval between them doubles. The first stays, so every time can still be reached,
    but by more steps; checkpoints on request stay, too. Raises CheckpointError if the folder cannot be emptied or written.
    """

    def __init__(self, folder: Path, plan: Plan) -> None:
        """Delete the checkpoints of earlier runs in the folder; CheckpointError if that fails."""
        self.folder = folder
        self._plan = plan
        self._unasked: dict[int, Path] = {}
        self._every = _steps_between(plan)
        self._versions = versions()
        try:
            for old in _files(folder):
                old.unlink()
        except OSError as error:
            raise CheckpointError(folder, f"cannot be written: {error.strerror or error}") from error

    def follow(self, plan: Plan) -> None:
        """Write `plan`, to which orders were added, into the checkpoints from now on."""
        self._plan = plan

    def is_due(self, index: int) -> bool:
        """Tell whether a checkpoint is due at a communication point without a request."""
        return self._every > 0 and index % self._every == 0

    def write(self, index: int, state: dict[str, Any], *, asked: bool) -> Path:
        """Write a checkpoint; CheckpointError if it cannot be written: then the earlier ones are unchanged."""
        time = index * self._plan.scenario.run.communication_step
        path = self.folder / f"step-{index:09d}{ENDING}"
        checkpoint = Checkpoint(
            scenario_hash=self._plan.fingerprint(index),
            index=index,
            time=time,
            run=self._plan.as_data() | {"versions": self._versions},
            state=state,
        )
        save_checkpoint(path, checkpoint)
        if asked:
            self._unasked.pop(index, None)
        else:
            self._unasked[index] = path
        return path

    def thin_out(self) -> str:
        """Delete checkpoints if there are too many, and return a message about it; empty if nothing was deleted."""
        if len(self._unasked) <= KEPT:
            return ""
        ends = min(self._unasked), max(self._unasked)
        self._every *= 2
        for index in [index for index in self._unasked if index % self._every and index not in ends]:
            self._unasked.pop(index).unlink(missing_ok=True)
        interval = self._every * self._plan.scenario.run.communication_step
        return f"more than {KEPT} checkpoints: from now on the first and one every {interval:g} s are kept"


@contextmanager
def checkpoint_writer(folder: Path, plan: Plan) -> Iterator[CheckpointWriter]:
    """Create a writer into `folder`, which this run alone uses within the block; CheckpointError if it cannot be created."""
    is_new = not folder.exists()
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise CheckpointError(folder, f"cannot be written: {error.strerror or error}") from error
    try:
        with held(folder):
            yield CheckpointWriter(folder, plan)
    finally:
        with suppress(OSError):  # one that holds something stays
            if is_new:
                folder.rmdir()


def _steps_between(plan: Plan) -> int:
    """Return the number of communication steps from one checkpoint to the next; 0 if they are written only on request."""
    interval = resolve(plan.scenario).recording.checkpoint_interval or 0.0
    return max(1, round(interval / plan.scenario.run.communication_step)) if interval > 0.0 else 0


@dataclass(frozen=True, kw_only=True, eq=False)
class Restart:
    """A run to continue: its plan, its state, and the checkpoint with that state.

    warning: the reason why the results may differ in the last bits; empty if they will not. left_out: orders of another run that cannot be
    given in this one, in words.
    """

    plan: Plan
    index: int
    state: Mapping[str, Any]
    source: Path
    warning: str = ""
    left_out: tuple[str, ...] = ()

    @property
    def files(self) -> dict[str, Path]:
        """The files that the run goes on from, over which nothing may be written, by their names in messages."""
        folder = self.source.parent
        files = {"the checkpoint to continue from": self.source, "the checkpoints to continue from": folder}
        if self.recording is not None:
            files["the recording to continue"] = self.recording
        return files

    @property
    def recording(self) -> Path | None:
        """The recording that the run goes on from; None for a checkpoint that lies in no recording's folder."""
        folder = self.source.absolute().parent
        return folder.with_suffix(RECORDING_ENDING) if folder.suffix == CHECKPOINTS_ENDING else None

    @property
    def time(self) -> float:
        """Simulated time [s] from which the run continues."""
        return self.index * self.plan.scenario.run.communication_step

    def with_settings(self, settings: tuple[str, ...], at: float | None, orders_of: Path | None = None) -> Restart:
        """Change settings at the first communication point at or after `at` [s]; None: where the run continues.

        Orders that the run was given since the checkpoint hold as before, up to that point; those of the recording `orders_of`, if any,
        hold there too, and are given again later. Raises ScenarioError for settings that are not allowed, and if the run would end where
        it continues.
        """
        index = self.index if at is None else _index_at(at, self.plan)
        replay, left_out = self._replay(index, orders_of), list[str]()
        plan = self.plan
        if replay is not None:
            plan = with_given_orders(plan, replay, self.index, index if orders_of is not None else index - 1)
        plan = plan.changed(settings, index)
        if replay is not None and orders_of is not None:
            plan, left_out = replayed_after(plan, replay, index)
        duration = plan.scenario.run.duration
        if index >= _index_at(duration, plan):
            if at is not None:
                raise ScenarioError(
                    [Problem("--at", f"is {at:g} s, allowed: before the run's end, {duration:g} s")], "oilsim"
                )
            begin = f"but the run continues from {self.time:g} s; allowed: a later end, set with --until"
            raise ScenarioError([Problem("run.duration", f"is {duration:g} s, {begin}")], "oilsim")
        return replace(self, plan=plan, left_out=tuple(left_out))

    def _replay(self, index: int, orders_of: Path | None) -> Replay | None:
        """Return the recording that tells the orders since the checkpoint; None if none came up to `index`, or it cannot be read."""
        if orders_of is None and (index <= self.index or self.recording is None or absence(self.recording)):
            return None
        from recordings.replay.joined import JoinedReplay  # only here, as it loads the reader of recordings
        from recordings.replay.recording import Replay

        if orders_of is not None:
            return JoinedReplay(orders_of)
        assert self.recording is not None
        try:
            return Replay(self.recording)
        except RecordingError:
            return None


def find_restart(path: Path, at: float | None = None, scenario_hash: str | None = None) -> Restart:
    """Find the last checkpoint at or before `at` [s] (None: the last) of a recording, or take the checkpoint `path` itself.

    Raises CheckpointError if there is none, or if it has another format or, unless None, belongs to another scenario.
    """
    checkpoint, source = _find(path, at)
    try:
        plan = plan_from(checkpoint.run)
    except (ScenarioError, ValueError, TypeError, LookupError, AttributeError) as error:
        raise CheckpointError(source, f"has no scenario that this program can run: {error}") from error
    found = plan.fingerprint(checkpoint.index)
    if checkpoint.scenario_hash != found:
        told = (
            f"belongs to a scenario with the hash {checkpoint.scenario_hash[:12]}, but describes one with {found[:12]}"
        )
        raise CheckpointError(source, f"{told}: a file of a mesh or FMU has changed, or the checkpoint itself")
    if scenario_hash is not None and scenario_hash != Plan(scenario=plan.scenario).fingerprint(0):
        raise CheckpointError(source, "belongs to another scenario than the one named with --resume")
    if at is not None and _index_at(at, plan) < checkpoint.index:
        raise CheckpointError(source, f"was saved at {checkpoint.time:g} s, allowed: --at {checkpoint.time:g} or later")
    return Restart(
        plan=plan,
        index=checkpoint.index,
        state=checkpoint.state,
        source=source,
        warning=_version_warning(checkpoint.run),
    )


def _find(path: Path, at: float | None) -> tuple[Checkpoint, Path]:
    """Find the checkpoint of a recording, a checkpoint file or a folder."""
    if path.suffix == ENDING:
        return load_checkpoint(path), path
    if not path.is_dir() and path.suffix != RECORDING_ENDING:
        allowed = f"a recording ({RECORDING_ENDING}), a checkpoint ({ENDING}), a folder of checkpoints"
        raise CheckpointError(path, f"is not a run to continue, allowed: {allowed}")
    folder = path if path.is_dir() else checkpoint_folder(path)
    files = _files(folder)
    if not files:
        if path.is_dir():
            raise CheckpointError(
                path, "is a folder without checkpoints, allowed: the recording of a run (.rrd), or its folder of them"
            )
        why = absence(path)
        if why:
            raise CheckpointError(path, why)
        from recordings.replay.repair import damage_of  # only here, as it loads the reader of recordings

        damage_of(path)  # which says what is no recording
        raise CheckpointError(path, f"has no checkpoints in {folder}")
    first = load_checkpoint(files[0])
    last = math.inf if at is None else _index_at(at, plan_from(first.run))
    chosen = [file for file in files if _index_of(file) <= last]
    if not chosen:
        raise CheckpointError(
            path, f"has no checkpoint at or before {at:g} s; its first one was saved at {first.time:g} s"
        )
    return (first if chosen[-1] == files[0] else load_checkpoint(chosen[-1])), chosen[-1]


def _files(folder: Path) -> list[Path]:
    """List the checkpoints in a folder, in order of time."""
    return sorted(file for file in folder.glob(f"step-*{ENDING}") if file.stem.removeprefix("step-").isdecimal())


def _index_of(file: Path) -> int:
    return int(file.stem.removeprefix("step-"))


def _index_at(time: float, plan: Plan) -> int:
    """Return the index of the first communication point at or after `time` [s]."""
    return math.ceil(time / plan.scenario.run.communication_step - 1e-6)


def _version_warning(run: Mapping[str, Any]) -> str:
    """Write which versions differ from those that wrote the checkpoint; empty if none does."""
    then, now = run.get("versions"), versions()
    then = then if isinstance(then, Mapping) else {}
    different = [f"{name} {then.get(name)} then, {now[name]} now" for name in _NUMERIC if then.get(name) != now[name]]
    return f"continues, but results may differ in the last bits: {'; '.join(different)}" if different else ""
