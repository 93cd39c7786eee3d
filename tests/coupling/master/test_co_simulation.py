"""The master: order, time, exchange of values, and how a run that fails ends."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.master.algorithms import GaussSeidel, Jacobi
from coupling.master.co_simulation import CommunicationPoint, CoSimulation
from coupling.master.connection import Connection
from coupling.master.errors import CoSimulationError, CouplingSetupError
from coupling.master.exchange_ledger import Exchange
from coupling.master.observer_dispatch import Watching
from coupling.master.participant import Status, StepResult
from recordings.model.frame import Event, Frame, RunDescription
from tests.coupling.accumulator import Accumulator


class Watcher:
    """Remembers what it is told."""

    def __init__(self) -> None:
        self.told: list[tuple[object, ...]] = []

    def initialized(self, run: RunDescription) -> None:
        self.told.append(("initialized", run.name))

    def step_completed(self, frame: Frame) -> None:
        self.told.append(("frame", frame.index, frame.time))

    def event(self, event: Event) -> None:
        self.told.append(("event", event.time, event.level, event.source, event.text))

    def terminated(self, reason: str) -> None:
        self.told.append(("terminated", reason))


def ring(log: list[tuple[object, ...]]) -> tuple[list[Accumulator], list[Connection]]:
    first, second = Accumulator("first", log), Accumulator("second", log)
    return [first, second], [Connection("first", "y", "second", "u"), Connection("second", "y", "first", "u")]


def watched(participants: list[Accumulator], connections: list[Connection], *watchers: object) -> CoSimulation:
    return CoSimulation(
        participants,
        connections,
        0.1,
        watching=Watching(
            watchers,  # type: ignore[arg-type]
            lambda point: Frame(index=point.index, time=point.time),
            RunDescription(name="ring", particle_spacing=0.1),
        ),
    )


def test_call_order_of_a_run() -> None:
    log: list[tuple[object, ...]] = []
    participants, connections = ring(log)
    run = CoSimulation(participants, connections, 0.5, start_time=2.0)
    run.initialize()
    run.step()
    run.terminate()
    names = [entry[:2] for entry in log]
    expected = [(n, c) for c in ("enter", "exit", "step", "terminate") for n in ("first", "second")]
    assert names == expected
    assert log[0] == ("first", "enter", 2.0)
    run.terminate()
    assert len(log) == 8


def test_gauss_seidel_and_jacobi_give_their_own_closed_forms() -> None:
    # y1' = y2, y2' = y1 with step H from (1, 1). Jacobi: both grow by (1 + H) a step.
    # Gauss-Seidel: y1 += H y2; y2 += H y1(new).
    for algorithm, expected in ((Jacobi(), (1.21, 1.21)), (GaussSeidel(), (1.1 + 0.111, 1.11 + 0.1211))):
        participants, connections = ring([])
        run = CoSimulation(participants, connections, 0.1, exchange=Exchange(algorithm))
        run.initialize()
        run.run(0.2)
        assert [float(p.output) for p in participants] == pytest.approx(expected, abs=1e-14)


def test_a_run_of_nobody_and_one_without_an_end_are_refused() -> None:
    with pytest.raises(CouplingSetupError, match="there are no participants, allowed: one or more"):
        CoSimulation([], [], 0.1)
    run = CoSimulation([Accumulator("pump", [])], [], 0.1)
    run.initialize()
    for until in (np.nan, np.inf):
        with pytest.raises(ValueError, match=f"run: until is {until} s, allowed: a finite time"):
            run.run(until)


def test_time_is_counted_in_whole_steps() -> None:
    log: list[tuple[object, ...]] = []
    participants, connections = ring(log)
    run = CoSimulation(participants, connections, 0.1, start_time=1.0)
    run.initialize()
    run.run(101.0)
    times = [entry[2] for entry in log if entry[:2] == ("first", "step")]
    assert times == [1.0 + k * 0.1 for k in range(1000)]
    assert run.communication_point.index == 1000
    assert run.communication_point.time == 1.0 + 1000 * 0.1
    run.run(101.0)
    assert run.communication_point.index == 1000


def test_initial_values_pass_through_before_the_first_step() -> None:
    participants, connections = ring([])
    participants[0].output = np.array(7.0)
    run = CoSimulation(participants, connections, 0.1)
    run.initialize()
    assert float(participants[1].input) == 7.0


def test_every_setup_problem_is_reported_at_once() -> None:
    participants = [Accumulator("a", []), Accumulator("b", [], (3,)), Accumulator("c", [], unit="N")]
    connections = [
        Connection("a", "y", "nobody", "u"),
        Connection("a", "nothing", "b", "u"),
        Connection("a", "u", "b", "y"),
        Connection("a", "y", "b", "u"),
        Connection("a", "y", "c", "u"),
    ]
    with pytest.raises(CouplingSetupError) as caught:
        CoSimulation([*participants, participants[0]], connections, 0.0)
    text = "\n".join(caught.value.problems)
    for part in (
        "participant 'a' appears twice",
        "target participant 'nobody' does not exist, allowed: a, b, c",
        "source variable 'nothing' does not exist, allowed: u, y, mean",
        "source is an input, allowed: output",
        "target is an output, allowed: input",
        "shape () feeds shape (3,)",
        "unit 'm' feeds unit 'N'",
        "the input b:u is fed by 2 connections, allowed: one",
        "communication_step_size is 0.0 s, allowed: above 0",
    ):
        assert part in text
    assert "a:y -> c:u" in text


def test_failing_participant_is_named_and_all_end_in_order() -> None:
    log: list[tuple[object, ...]] = []
    participants = [Accumulator(name, log) for name in ("one", "two", "three")]
    watcher = Watcher()
    run = watched(participants, [], watcher)
    run.initialize()
    run.step()

    def break_down(time: float, step_size: float) -> StepResult:
        raise ZeroDivisionError("no water under the keel")

    participants[1].on_step = break_down
    log.clear()
    with pytest.raises(CoSimulationError, match=r"'two' failed at 0\.1 s: no water under the keel") as caught:
        run.step()
    assert (caught.value.participant, caught.value.time) == ("two", 0.1)
    assert isinstance(caught.value.__cause__, ZeroDivisionError)
    assert log == [
        ("one", "step", 0.1, 0.1),
        ("two", "step", 0.1, 0.1),
        ("one", "terminate"),
        ("two", "terminate"),
        ("three", "terminate"),
    ]
    assert watcher.told[-2][:4] == ("event", 0.1, "error", "two")
    assert watcher.told[-1][0] == "terminated"
    with pytest.raises(RuntimeError, match="step is called on a run that is terminated"):
        run.step()


@pytest.mark.parametrize("at_start", [True, False])
@pytest.mark.parametrize(
    ("call", "owner", "message"),
    [
        ("set", "second", r"the input 'u' does not accept 1\.?\d* from first:y: no such quay"),
        ("get", "first", r"the output '\w+' cannot be read: no such"),
    ],
)
def test_value_that_is_not_taken_or_given_is_named_with_its_participant(
    monkeypatch: pytest.MonkeyPatch, call: str, owner: str, message: str, at_start: bool
) -> None:
    (first, second), _ = ring([])

    def refuse(*arguments: object) -> None:
        raise ZeroDivisionError("no such quay")

    run = CoSimulation([first, second], [Connection("first", "y", "second", "u")], 0.1)
    if not at_start:
        run.initialize()
    monkeypatch.setattr({"first": first, "second": second}[owner], call, refuse)
    with pytest.raises(CoSimulationError, match=rf"participant '{owner}' failed at 0 s: {message}") as caught:
        run.initialize() if at_start else run.step()
    assert isinstance(caught.value.__cause__, ZeroDivisionError)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (3.0, r"the output 'y' is a float, allowed: an array of shape \(1,\)"),
        (np.zeros(5), r"the output 'y' has shape \(5,\), allowed: \(1,\)"),
    ],
)
@pytest.mark.parametrize("connected", [True, False])
def test_output_of_another_shape_is_found_at_the_start(value: object, message: str, connected: bool) -> None:
    first, second = Accumulator("first", [], (1,)), Accumulator("second", [], (1,))
    first.get = lambda name: value  # type: ignore[method-assign, assignment, return-value]
    run = CoSimulation([second, first], [Connection("first", "y", "second", "u")] if connected else [], 0.1)
    with pytest.raises(CoSimulationError, match=f"'first' failed at 0 s: {message}"):
        run.initialize()


def test_time_that_is_none_is_told_of_its_participant() -> None:
    pump = Accumulator("pump", [])
    pump.do_step = lambda time, step: StepResult(Status.OK, None)  # type: ignore[method-assign,arg-type]
    run = CoSimulation([pump], [], 0.1)
    run.initialize()
    with pytest.raises(
        CoSimulationError, match="'pump' failed at 0 s: last_successful_time is None, allowed: a number"
    ):
        run.step()


def test_text_for_a_number_is_told_of_its_participant() -> None:
    pump = Accumulator("pump", [])
    pump.get = lambda name: np.array("fast")  # type: ignore[method-assign]
    run = CoSimulation([pump], [], 0.1)
    with pytest.raises(
        CoSimulationError, match="'pump' failed at 0 s: the output 'y' is of type <U4, allowed: real numbers"
    ):
        run.initialize()


def test_step_without_a_result_is_named() -> None:
    participant = Accumulator("pump", [])
    participant.do_step = lambda time, step_size: None  # type: ignore[method-assign, assignment, return-value]
    run = CoSimulation([participant], [], 0.1)
    run.initialize()
    with pytest.raises(CoSimulationError, match="'pump' failed at 0 s: do_step returned None, allowed: a StepResult"):
        run.step()


@pytest.mark.parametrize(
    ("result", "message"),
    [
        (StepResult(Status.ERROR, 0.0, "rope parted"), "error: rope parted"),
        (StepResult(Status.DISCARD, 0.0), "discard: no reason given"),
        (StepResult(Status.OK, 0.05), "stopped at 0.05 s"),
        (StepResult(Status.OK, 0.2), "reached 0.2 s"),
        (StepResult(Status.EARLY_RETURN, -0.1), "reached -0.1 s"),
        (StepResult(Status.EARLY_RETURN, 0.0), "stopped at 0.0 s"),
    ],
)
def test_bad_step_results_end_the_run(result: StepResult, message: str) -> None:
    participant = Accumulator("pump", [])
    participant.on_step = lambda time, step_size: result
    run = CoSimulation([participant], [], 0.1)
    run.initialize()
    with pytest.raises(CoSimulationError, match=message):
        run.step()


def test_early_return_is_no_error() -> None:
    log: list[tuple[object, ...]] = []
    participant = Accumulator("pump", log)
    participant.on_step = lambda time, step_size: (
        StepResult(Status.EARLY_RETURN, time + 0.04) if step_size > 0.07 else None
    )
    run = CoSimulation([participant], [], 0.1)
    run.initialize()
    run.step()
    steps = [entry[2:] for entry in log if entry[1] == "step"]
    np.testing.assert_allclose(steps, [(0.0, 0.1), (0.04, 0.06)], atol=1e-15)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_output_that_is_not_finite_is_found_with_its_owner(value: float) -> None:
    participants = [Accumulator("fluid", []), Accumulator("bodies", [])]
    run = CoSimulation(participants, [], 0.1)
    run.initialize()
    run.step()
    participants[1].output = np.array(value)
    with pytest.raises(CoSimulationError, match=r"'bodies' failed at 0\.2 s: the output 'y' is (nan|inf)"):
        run.step()


def test_observers_see_every_point_and_the_end() -> None:
    participants, connections = ring([])
    watcher = Watcher()
    run = watched(participants, connections, watcher)
    run.initialize()
    run.run(0.2)
    run.emit("boom deployed", source="trainer")
    run.terminate("done")
    assert watcher.told == [
        ("initialized", "ring"),
        ("frame", 0, 0.0),
        ("frame", 1, 0.1),
        ("frame", 2, 0.2),
        ("event", 0.2, "info", "trainer", "boom deployed"),
        ("terminated", "done"),
    ]


def test_observer_that_fails_at_the_start_leaves_the_others_out_of_a_run_they_never_saw_begin() -> None:
    class Unready(Watcher):
        def initialized(self, run: RunDescription) -> None:
            raise OSError("no disk")

    before, after = Watcher(), Watcher()
    participants, connections = ring([])
    run = watched(participants, connections, before, Unready(), after)
    with pytest.raises(OSError, match="no disk"):
        run.initialize()
    assert before.told == [("initialized", "ring"), ("terminated", "the observer Unready failed: no disk")]
    assert after.told == []


def test_events_before_a_failure_are_told_before_it() -> None:
    """The first one's event lies in the step in which the second one fails."""

    class Switch(Accumulator):
        def update_discrete_states(self) -> bool:
            return False

    log: list[tuple[object, ...]] = []
    first, second = Switch("first", log), Accumulator("second", log)
    first.on_step = lambda time, step: StepResult(Status.OK, time + step, "valve shut", event_handling_needed=True)
    second.on_step = lambda time, step: StepResult(Status.ERROR, time, "broken")
    watcher = Watcher()
    run = watched([first, second], [], watcher)
    run.initialize()
    with pytest.raises(CoSimulationError, match="broken"):
        run.step()
    assert [told[-1] for told in watcher.told if told[0] == "event"] == [
        "valve shut", "participant 'second' failed at 0 s: error: broken",
    ]  # fmt: skip


def test_failing_observer_ends_the_run_in_order() -> None:
    class FullDisk(Watcher):
        def step_completed(self, frame: Frame) -> None:
            if frame.index == 1:
                raise OSError("no space left")

    log: list[tuple[object, ...]] = []
    participants, connections = ring(log)
    watcher = Watcher()
    run = watched(participants, connections, FullDisk(), watcher)
    run.initialize()
    with pytest.raises(OSError, match="no space left"):
        run.step()
    assert log[-2:] == [("first", "terminate"), ("second", "terminate")]
    assert watcher.told[-1] == ("terminated", "the observer FullDisk failed: no space left")


def test_frames_are_not_made_for_nobody() -> None:
    participants, connections = ring([])
    asked: list[object] = []

    def count(point: object) -> Frame:
        asked.append(point)
        return Frame(index=len(asked), time=0.0)

    run = CoSimulation(participants, connections, 0.1, watching=Watching(frame_source=count))
    run.initialize()
    run.step()
    assert asked == []


def test_accounts_advance_once_at_every_point_before_observers_are_told() -> None:
    told: list[tuple[str, int]] = []

    class Teller(Watcher):
        def step_completed(self, frame: Frame) -> None:
            told.append(("frame", frame.index))

    def account(point: CommunicationPoint) -> None:
        assert point.time == pytest.approx(0.1 * point.index)
        told.append(("account", point.index))

    def made(*watchers: Watcher) -> CoSimulation:
        participants, connections = ring([])
        return CoSimulation(
            participants,
            connections,
            0.1,
            exchange=Exchange(GaussSeidel(), accounts=[account]),
            watching=Watching(
                watchers,
                lambda point: Frame(index=point.index, time=point.time),
                RunDescription(name="ring", particle_spacing=0.1),
            ),
        )

    run = made(Teller(), Teller())
    run.initialize()
    run.step()
    assert told == [("account", 0), ("frame", 0), ("frame", 0), ("account", 1), ("frame", 1), ("frame", 1)]
    told.clear()
    again = made()
    again.initialize(run.save_state())  # the account of that point belongs to the run that was saved
    again.step()
    assert told == [("account", 2)]


def test_account_that_fails_ends_the_run_by_name() -> None:
    def overdrawn(point: CommunicationPoint) -> None:
        if point.index == 1:
            raise ValueError("overdrawn")

    log: list[tuple[object, ...]] = []
    participants, connections = ring(log)
    run = CoSimulation(participants, connections, 0.1, exchange=Exchange(GaussSeidel(), accounts=[overdrawn]))
    run.initialize()
    with pytest.raises(CoSimulationError, match=r"'accounts' failed at 0\.1 s: overdrawn"):
        run.step()
    assert log[-2:] == [("first", "terminate"), ("second", "terminate")]


def test_failure_during_initialization_is_named() -> None:
    log: list[tuple[object, ...]] = []
    participants = [Accumulator("one", log), Accumulator("two", log)]

    def refuse() -> None:
        raise OSError("no licence")

    participants[1].exit_initialization_mode = refuse  # type: ignore[method-assign]
    participants[1].terminate = refuse  # type: ignore[method-assign]  # the failure that came first is told
    run = CoSimulation(participants, [], 0.1)
    with pytest.raises(CoSimulationError, match="'two' failed at 0 s: no licence"):
        run.initialize()
    assert log[-1] == ("one", "terminate")


def test_wall_time_is_counted_per_participant() -> None:
    participants, connections = ring([])
    run = CoSimulation(participants, connections, 0.1)
    run.initialize()
    run.run(1.0)
    assert set(run.wall_seconds) == {"first", "second"}
    assert all(seconds > 0.0 for seconds in run.wall_seconds.values())


def test_values_are_checked_when_set() -> None:
    participant = Accumulator("pump", [], (3,))
    with pytest.raises(ValueError, match="'pump' has no variable 'x', allowed: u, y, mean"):
        participant.set("x", np.zeros(3))
    with pytest.raises(ValueError, match="'y' is an output"):
        participant.set("y", np.zeros(3))
    with pytest.raises(ValueError, match=r"'u' has shape \(2,\), allowed: \(3,\)"):
        participant.set("u", np.zeros(2))


# the end, whatever brings it


@pytest.mark.parametrize("where", ["participant", "observer"])
def test_interrupted_run_ends_in_order(where: str) -> None:
    """Ctrl-C comes at any time: those that have stepped already would step a second time in a run that went on."""

    class Interrupted(Watcher):
        def step_completed(self, frame: Frame) -> None:
            if where == "observer" and frame.index == 1:
                raise KeyboardInterrupt
            super().step_completed(frame)

    def interrupt(time: float, step: float) -> StepResult | None:
        if where == "participant":
            raise KeyboardInterrupt
        return None

    log: list[tuple[object, ...]] = []
    participants, connections = ring(log)
    participants[1].on_step = interrupt
    watcher = Watcher()
    run = watched(participants, connections, Interrupted(), watcher)
    run.initialize()
    with pytest.raises(KeyboardInterrupt):
        run.run(1.0)
    assert not run.is_running
    assert log[-2:] == [("first", "terminate"), ("second", "terminate")]
    cause = {"participant": "interrupted by", "observer": "the observer Interrupted failed:"}[where]
    assert watcher.told[-1] == ("terminated", f"{cause} KeyboardInterrupt")


@pytest.mark.parametrize("where", ["participant", "observer"])
def test_interrupted_end_is_brought_to_its_end(where: str) -> None:
    class Interrupted(Watcher):
        def terminated(self, reason: str) -> None:
            super().terminated(reason)
            if where == "observer":
                raise KeyboardInterrupt

    log: list[tuple[object, ...]] = []
    participants, connections = ring(log)
    end = participants[0].terminate

    def interrupted() -> None:
        end()
        if where == "participant":
            raise KeyboardInterrupt

    participants[0].terminate = interrupted  # type: ignore[method-assign]
    watchers = Interrupted(), Watcher()
    run = watched(participants, connections, *watchers)
    run.initialize()
    with pytest.raises(KeyboardInterrupt):
        run.terminate("done")
    assert log[-2:] == [("first", "terminate"), ("second", "terminate")]
    assert [watcher.told[-1] for watcher in watchers] == 2 * [("terminated", "done")]


def test_frame_that_cannot_be_made_ends_the_run_by_name() -> None:
    def torn(point: CommunicationPoint) -> Frame:
        if point.index == 2:
            raise ValueError("no positions")
        return Frame(index=point.index, time=point.time)

    log: list[tuple[object, ...]] = []
    participants, connections = ring(log)
    watcher = Watcher()
    description = RunDescription(name="ring", particle_spacing=0.1)
    run = CoSimulation(participants, connections, 0.1, watching=Watching([watcher], torn, description))
    run.initialize()
    with pytest.raises(CoSimulationError, match=r"'frame_source' failed at 0\.2 s: no positions"):
        run.run(1.0)
    assert log[-2:] == [("first", "terminate"), ("second", "terminate")]
    assert [told[0] for told in watcher.told] == ["initialized", "frame", "frame", "event", "terminated"]


def test_every_observer_hears_of_the_end_once_and_of_nothing_after_it() -> None:
    class Deaf(Watcher):
        def terminated(self, reason: str) -> None:
            super().terminated(reason)
            raise OSError("no space left")

    participants, connections = ring([])
    watchers = Watcher(), Deaf(), Watcher()
    run = watched(participants, connections, *watchers)
    run.initialize()
    with pytest.raises(OSError, match="no space left"):
        run.terminate("done")
    assert [watcher.told[-1] for watcher in watchers] == 3 * [("terminated", "done")]
    with pytest.raises(RuntimeError, match="emit is called on a run that is terminated, allowed: running"):
        run.emit("too late")
    assert [[told[0] for told in watcher.told] for watcher in watchers] == 3 * [["initialized", "frame", "terminated"]]


@pytest.mark.parametrize("start", [0.0, 1e6, -1e6])
@pytest.mark.parametrize("step", [0.01, 0.1, 1.0 / 3.0])
def test_run_meets_a_far_point_and_makes_no_step_too_many(start: float, step: float) -> None:
    """`until` is rounded to 1e-10 s there, a hundred millionth of a step."""
    run = CoSimulation([Accumulator("pump", [])], [], step, start_time=start)
    run.initialize()
    for index in range(1, 200):
        run.run(start + index * step)
        assert run.communication_point.index == index


@pytest.mark.parametrize(("option", "value"), [("step_size", 0.2), ("start_time", 3.0)])
def test_saved_run_goes_on_with_its_own_clock_only(option: str, value: float) -> None:
    def made(step_size: float = 0.1, start_time: float = 2.0) -> CoSimulation:
        return CoSimulation([Accumulator("pump", [])], [], step_size, start_time=start_time)

    first = made()
    first.initialize()
    first.run(2.5)
    saved = first.save_state()
    again = made()
    again.initialize(saved)
    assert again.communication_point == first.communication_point
    own = {"step_size": 0.1, "start_time": 2.0}[option]
    message = f"'master' failed at .* s: {option} of the saved state is {own} s, allowed: {value} s"
    with pytest.raises(CoSimulationError, match=message):
        made(**{option: value}).initialize(saved)


def test_run_goes_on_where_a_state_cannot_be_saved() -> None:
    def refuse() -> object:
        raise NotImplementedError("a device")

    participants, connections = ring([])
    participants[1].save_state = refuse  # type: ignore[method-assign]
    run = watched(participants, connections)
    run.initialize()
    with pytest.raises(NotImplementedError, match="participant 'second': a device"):
        run.save_state()
    run.step()
    assert run.communication_point.index == 1


def test_start_at_which_a_step_is_lost_in_rounding_is_refused() -> None:
    CoSimulation([Accumulator("pump", [])], [], 0.01, start_time=1.7e9)
    with pytest.raises(
        CouplingSetupError, match=r"start_time is 1e\+17 s, allowed: a time small enough that steps of 0.01 s change it"
    ):
        CoSimulation([Accumulator("pump", [])], [], 0.01, start_time=1e17)
