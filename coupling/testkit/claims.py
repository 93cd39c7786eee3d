"""Checks of the numerics: convergence, half the step, threads, recordings, FMUs, restarts.

Checks of a run that fails or goes on after a fault: who is named, when, and that all are told.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Protocol

import numpy as np

from coupling.master.co_simulation import CoSimulation
from coupling.master.errors import CoSimulationError
from coupling.master.participant import Causality, Participant
from coupling.testkit.body_checks import order_of_convergence
from coupling.testkit.faults import ON_PURPOSE
from coupling.testkit.readings import BodyTrack, Readings, readings_of
from coupling.testkit.run import TestRun
from coupling.testkit.verdict import CheckFailed, Context, require_at_most, require_near
from oilsim.backend.arrays import Array
from recordings.files.checkpoint import state_hash


def assert_converges(
    run: Callable[[float], float],
    spacings: Sequence[float],
    *,
    order: float,
    exact: float | None = None,
    within: float = 0.3,
) -> None:
    """Require that the result of `run(spacing)` converges with an order of at least `order` - `within` [1]; CheckFailed if not.

    spacings [m]: two or more, decreasing; three, in constant ratio, if there is no `exact` result. The order is the slope of ln error over
    ln spacing, or without an exact result ln((r_1 - r_2) / (r_2 - r_3)) / ln ratio (Richardson). Raises ValueError for other spacings.
    """
    least = 2 if exact is not None else 3
    if len(spacings) < least or any(later >= earlier for earlier, later in pairwise(spacings)):
        raise ValueError(f"spacings are {list(spacings)} m, allowed: {least} or more, decreasing")
    results = [float(run(spacing)) for spacing in spacings]
    if exact is not None:
        found = order_of_convergence(spacings, [abs(result - exact) for result in results])
    else:
        first, second = results[-3] - results[-2], results[-2] - results[-1]
        found = math.log(first / second) / math.log(spacings[-3] / spacings[-2]) if first * second > 0.0 else math.nan
    if found >= order - within:
        return
    pairs = ", ".join(f"{result:.6g} at {spacing:g} m" for spacing, result in zip(spacings, results, strict=True))
    told = f"order of convergence is {found:.3g}, expected: {order:.3g} within {within:.3g} or higher; the results are {pairs}"
    if math.isnan(found):
        told += "; they do not approach a limit one by one, or one is exact"
    raise CheckFailed(told, found, order, within, "", Context())


def assert_same_at_half_step(run: Callable[[float], float], step: float, *, within: float, unit: str = "") -> None:
    """Require that `run(step)` and `run(step / 2)` differ by `within` at most, in `unit`; step [s]. CheckFailed if they differ more."""
    whole, half = float(run(step)), float(run(0.5 * step))
    what = f"result is {whole:.6g} {unit} with steps of {step:g} s and {half:.6g} {unit} with half of them: the change"
    require_at_most(what, abs(whole - half), within, unit)


def assert_same_on_threads(
    build: Callable[[int], TestRun], *, steps: int = 10, threads: Sequence[int] = (1, 2)
) -> None:
    """Require that runs on different numbers of threads have equal states, bit for bit, after `steps`; CheckFailed if not.

    build: returns a scene or a scenario run for a number of threads; it is closed afterwards.
    """
    hashes = {}
    for count in threads:
        with build(count) as scene:
            for _ in range(steps):
                scene.step()
            hashes[count] = state_hash(scene.save_state())
    if len(set(hashes.values())) > 1:
        told = ", ".join(f"{found[:12]} on {count}" for count, found in hashes.items())
        raise CheckFailed(
            f"state after {steps} steps depends on the number of threads: {told}, expected: equal bit for bit",
            1.0, 0.0, 0.0, "", Context(),
        )  # fmt: skip


def assert_restarts_exactly(build: Callable[[], TestRun], *, at: int, steps: int) -> None:
    """Require that a run restored from its state after `at` steps makes the next `steps` bit for bit as the first did.

    build: returns a new scene or scenario run at each call; both are closed afterwards. Raises CheckFailed if the states differ.
    """
    with build() as first:
        for _ in range(at):
            first.step()
        saved = first.save_state()
        for _ in range(steps):
            first.step()
        expected = state_hash(first.save_state())
    with build() as second:
        second.restore_state(saved)
        for _ in range(steps):
            second.step()
        found = state_hash(second.save_state())
    if found != expected:
        told = f"state {steps} steps after a restart is {found[:12]}, expected: {expected[:12]}, as without it"
        raise CheckFailed(told, 1.0, 0.0, 0.0, "", Context())


class Reference:
    """Says whether references are written anew instead of compared; the pytest plugin sets it by --oilsim-update."""

    is_updated = False


def assert_matches_recording(source: object, file: str | Path, *, within: Mapping[str, float] | float = 0.0) -> None:
    """Require that all motions and series of a run are those of a recording, at the times that both have.

    within: allowed difference of each body's position [m] and of each series (its unit), or a mapping of these by name, with 0 for all
    others. Series that depend on the machine's speed are left out. With pytest's option --oilsim-update the recording is written anew
    instead. Raises CheckFailed for the largest difference beyond its tolerance, and for a body or series that is missing,
    FileNotFoundError without the file, and TypeError for a run that keeps no history.
    """
    path, readings = Path(file), readings_of(source)
    if Reference.is_updated:
        from coupling.testkit.left_behind import write_recording

        history = getattr(source, "history", None)
        if history is None:
            raise TypeError(
                f"{readings.source} cannot be recorded, allowed: a scene, a watched world or a scenario run"
            )
        write_recording(history, path)
        return
    if not path.is_file():
        raise FileNotFoundError(
            f"reference recording {path} does not exist, allowed: a file, which --oilsim-update writes"
        )
    from coupling.testkit.readings import readings_of_recording
    from recordings.replay.replay_check import is_of_the_machine

    then = readings_of_recording(path)
    _require_same_names("bodies", then.bodies, readings.bodies)
    for name, track in then.bodies.items():
        _compare_bodies(name, track, readings, _allowed(within, name))
    compared = {name: track for name, track in then.series.items() if not is_of_the_machine(name)}
    _require_same_names("series", compared, readings.series)
    for name, series in compared.items():
        now = readings.series[name]
        times, before, after = _common(series.time, series.value, now.time, now.value)
        _compare(f"series {name!r}", times, np.abs(after - before), _allowed(within, name), "", ())


class Steps(Protocol):
    """Makes the steps of an FMU or of a reference: returns outputs by name after a step with these inputs."""

    def __call__(self, time: float, inputs: Mapping[str, float]) -> Mapping[str, float]:
        """Make the step from `time` [s]; values in the units of the FMU's variables."""


def assert_fmu_agrees(
    fmu: Participant,
    reference: Participant | Steps,
    *,
    inputs: Callable[[float], Mapping[str, float]],
    step_size: float,
    steps: int,
    within: float = 0.0,
) -> None:
    """Require that all scalar outputs of an FMU and of a reference agree to `within`, in their units, step by step; CheckFailed if not.

    inputs: of both, by name, as a function of time [s]. reference: another participant, such as the model itself, or a function that
    returns the outputs. step_size [s]. Both participants are initialized before and terminated afterwards. Raises ValueError for an
    output that the FMU lacks.
    """
    expect = reference if callable(reference) else partial(_stepped, reference, step_size)
    both = [fmu] if callable(reference) else [fmu, reference]
    for one in both:
        one.enter_initialization_mode(0.0)
        one.exit_initialization_mode()
    try:
        for index in range(steps):
            time = index * step_size
            given = inputs(time)
            found, expected = _stepped(fmu, step_size, time, given), expect(time, given)
            for name in expected:
                if name not in found:
                    raise ValueError(f"{fmu.name!r} has no output {name!r}, allowed: {', '.join(found)}")
                unit, error = fmu.variables[name].unit, abs(found[name] - expected[name])
                what = f"output {name!r} is {found[name]:.6g} {unit}, of the reference {expected[name]:.6g} {unit}: the difference"
                require_at_most(what, error, within, unit, Context(time=time + step_size))
    finally:
        for one in both:
            one.terminate()


def _stepped(one: Participant, step_size: float, time: float, inputs: Mapping[str, float]) -> dict[str, float]:
    for name, value in inputs.items():
        one.set(name, np.full(one.variables[name].shape, value))
    one.do_step(time, step_size)
    outputs = [name for name, variable in one.variables.items() if variable.causality is Causality.OUTPUT]
    return {name: float(one.get(name).ravel()[0]) for name in outputs if one.variables[name].shape in ((), (1,))}


def _require_same_names(what: str, then: Mapping[str, object], now: Mapping[str, object]) -> None:
    missing, new = sorted(set(then) - set(now)), sorted(set(now) - set(then))
    if missing or (new and what == "bodies"):
        told = f"{what} of the run lack {missing} and have {new} besides, expected: those of the recording"
        raise CheckFailed(told, float(len(missing) + len(new)), 0.0, 0.0, "", Context())


def _allowed(within: Mapping[str, float] | float, name: str) -> float:
    return within.get(name, 0.0) if isinstance(within, Mapping) else within


def _compare_bodies(name: str, then: BodyTrack, readings: Readings, within: float) -> None:
    now = readings.bodies[name]
    times, before, after = _common(then.time, then.pose[:, :3], now.time, now.pose[:, :3])
    _compare(f"position of {name!r}", times, np.linalg.norm(after - before, axis=1), within, "m", (name,))


def _compare(what: str, times: Array, errors: Array, within: float, unit: str, bodies: tuple[str, ...]) -> None:
    worst = int(np.argmax(np.where(np.isnan(errors), -1.0, errors)))
    context = Context(bodies=bodies, time=float(times[worst]))
    require_at_most(f"{what} against the recording", float(errors[worst]), within, unit, context, verb="differs by")


def _common(time: Array, value: Array, time_now: Array, value_now: Array) -> tuple[Array, Array, Array]:
    """Return the times that both have, and both values there; CheckFailed if there are none."""
    _, rows, rows_now = np.intersect1d(np.round(time, 9), np.round(time_now, 9), return_indices=True)
    if not len(rows):
        raise CheckFailed(
            f"run covers {time_now[0]:g} to {time_now[-1]:g} s, expected: times of the recording, {time[0]:g} to {time[-1]:g} s",
            0.0, None, 0.0, "s", Context(),
        )  # fmt: skip
    return time[rows], value[rows], value_now[rows_now]


@contextmanager
def fails_in_order(run: TestRun, *, participant: str, at: float | None = None, match: str = "") -> Iterator[None]:
    """Require that the block's steps end the run in order: by a CoSimulationError that names the participant and the time.

    at [s]: communication point at which the failing step began, to half a step; None: any. match: regular expression for the message.
    Afterwards the run must not go on, and the history must have been told the reason. Raises AssertionError for anything else.
    """
    simulation = run.simulation
    try:
        yield
    except CoSimulationError as error:
        failure = error
    else:
        raise _went_on(simulation, repr(participant))
    if failure.participant != participant:
        raise AssertionError(f"{failure.participant!r} is named ({failure}), expected: {participant!r}") from failure
    if at is not None:
        half = 0.5 * simulation.communication_point.step_size
        require_near(f"time at which {participant!r} fails", failure.time, at, half, "s")
    _require_end(run, failure, str(failure), match)


@contextmanager
def viewer_fails_in_order(run: TestRun, *, match: str = "") -> Iterator[None]:
    """Require that an observer that raises in the block's steps ends the run in order: participants end, and other observers are told.

    match: regular expression for the observer's error, which the block raises as it is. Raises AssertionError for anything else.
    """
    simulation = run.simulation
    try:
        yield
    except CoSimulationError as error:
        raise AssertionError(f"{error.participant!r} is named ({error}), expected: an observer fails") from error
    except Exception as error:
        failure = error
    else:
        raise _went_on(simulation, "a viewer")
    _require_end(run, failure, f"failed: {failure}", match)


@contextmanager
def goes_on_in_order(run: TestRun, *, match: str = "") -> Iterator[None]:
    """Require that the run goes on through the block, although something fails in it, and that its log tells of that.

    match: regular expression for the text of the event, "fault on purpose" for any planned fault. Raises AssertionError for a run that
    ends, and where nothing is told.
    """
    simulation, before = run.simulation, len(run.history.events)
    try:
        yield
    except Exception as error:
        raise AssertionError(f"the run failed: {error}, expected: it goes on") from error
    if not simulation.is_running:
        raise AssertionError(f"the run has ended: {run.history.ended!r}, expected: it goes on")
    told = [event.text for event in run.history.events[before:]]
    if not any(re.search(match or ON_PURPOSE, text) for text in told):
        raise AssertionError(f"the log tells of {told}, expected: {match or ON_PURPOSE!r}")


def _went_on(simulation: CoSimulation, who: str) -> AssertionError:
    return AssertionError(f"the run went on to {simulation.communication_point.time:g} s, expected: {who} ends it")


def _require_end(run: TestRun, failure: Exception, reason: str, match: str) -> None:
    """Require that the failure says `match`, that the run has ended, and that the history was told the reason."""
    if not re.search(match, str(failure)):
        raise AssertionError(f"the failure says {str(failure)!r}, expected: {match!r}") from failure
    if run.simulation.is_running:
        raise AssertionError(f"the run goes on after {str(failure)!r}, expected: its end") from failure
    if reason not in run.history.ended:
        raise AssertionError(f"observers were told {run.history.ended!r} at the end, expected: {reason!r}") from failure
