"""The rules of FMI 3 in the master: parts of steps, events, discarded steps, rollback, loops, units."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from coupling.master.algorithms import GaussSeidel, Jacobi, Steppers
from coupling.master.co_simulation import CoSimulation
from coupling.master.connection import Connection, Link
from coupling.master.errors import CoSimulationError, CouplingSetupError
from coupling.master.exchange_ledger import Exchange, ExchangeLedger
from coupling.master.observer_dispatch import Watching
from coupling.master.participant import Causality, Participant, Status, StepResult, Variable, variable_table
from coupling.master.units import Unit
from oilsim.backend.arrays import Array
from recordings.model.frame import Event, Frame, RunDescription
from tests.coupling.accumulator import Accumulator

Log = list[tuple[object, ...]]


class Function(Participant):
    """y = f(u) at once: a participant whose output depends on its input without a step between."""

    def __init__(self, name: str, function: Callable[[Array], object], size: int = 1) -> None:
        super().__init__(
            name, [Variable("u", "1", (size,), Causality.INPUT), Variable("y", "1", (size,), Causality.OUTPUT)]
        )
        self.function = function
        self.input = np.zeros(size)

    def get(self, name: str) -> Array:
        return np.array(self.function(self.input), dtype=float).reshape(self.input.shape)

    def set(self, name: str, value: Array) -> None:
        self.input = np.copy(value)

    def do_step(self, time: float, step_size: float) -> StepResult:
        return StepResult(Status.OK, time + step_size)

    def save_state(self) -> object:
        raise NotImplementedError


class Log2:
    """An observer that keeps events and the reason of the end."""

    def __init__(self) -> None:
        self.events: list[Event] = []
        self.frames: list[float] = []
        self.reason = ""

    def initialized(self, run: RunDescription) -> None: ...

    def step_completed(self, frame: Frame) -> None:
        self.frames.append(frame.time)

    def event(self, event: Event) -> None:
        self.events.append(event)

    def terminated(self, reason: str) -> None:
        self.reason = reason


def watched(participants: list, connections: list[Connection], **options: object) -> tuple[CoSimulation, Log2]:
    watcher = Log2()
    run = CoSimulation(
        participants,
        connections,
        0.1,
        watching=Watching(
            [watcher],
            lambda point: Frame(index=point.index, time=point.time),
            RunDescription(name="rules", particle_spacing=0.1),
        ),
        **options,  # type: ignore[arg-type]
    )
    return run, watcher


def steps_of(log: Log, name: str) -> list[tuple[float, float]]:
    return [(entry[2], entry[3]) for entry in log if entry[:2] == (name, "step")]  # type: ignore[misc]


# sub-rates and parts of steps


def test_sub_rate_makes_equal_steps_with_inputs_held() -> None:
    log: Log = []
    fast, slow = Accumulator("fast", log), Accumulator("slow", log)
    connections = [Connection("slow", "y", "fast", "u"), Connection("fast", "mean", "slow", "u")]
    run = CoSimulation([fast, slow], connections, 0.1, sub_rates={"fast": 4})
    run.initialize()
    run.step()
    np.testing.assert_allclose(steps_of(log, "fast"), [(0.025 * k, 0.025) for k in range(4)], atol=1e-15)
    assert len(steps_of(log, "slow")) == 1
    # fast: y' = 1 from 1, so that its mean over the whole step is 1 + H / 2, not that of the last quarter
    assert float(slow.input) == pytest.approx(1.05, abs=1e-15)


def test_mean_outputs_are_weighted_over_early_returns() -> None:
    log: Log = []
    pump, tank = Accumulator("pump", log), Accumulator("tank", log)
    pump.on_step = lambda time, step: StepResult(Status.EARLY_RETURN, time + 0.03) if step > 0.08 else None
    pump.input = np.array(2.0)
    run = CoSimulation([pump, tank], [Connection("pump", "mean", "tank", "u")], 0.1)
    run.initialize()
    run.step()
    assert len(steps_of(log, "pump")) == 2
    assert float(tank.input) == pytest.approx(1.0 + 0.5 * 0.1 * 2.0, abs=1e-14)


@pytest.mark.parametrize("sub_rate", [1, 2])
def test_mean_over_a_part_that_is_not_finite_is_found_with_its_owner(sub_rate: int) -> None:
    """The last part's mean is finite; the whole step's is not."""
    pump = Accumulator("pump", [])

    def early(time: float, step_size: float) -> StepResult | None:
        pump.input = np.array(math.nan if time < 0.05 else 0.0)
        pump.output = np.array(1.0)
        return StepResult(Status.EARLY_RETURN, 0.05) if sub_rate == 1 and time < 0.05 else None

    pump.on_step = early
    run = CoSimulation([pump], [], 0.1, sub_rates={"pump": sub_rate})
    run.initialize()
    with pytest.raises(CoSimulationError, match=r"'pump' failed at 0\.1 s: the output 'mean' is nan, allowed: finite"):
        run.step()


def test_wrong_sub_rates_are_refused() -> None:
    with pytest.raises(
        CouplingSetupError, match=r"sub_rates has the participant 'c', allowed: a; the sub-rate of 'a' is 0, allowed"
    ):
        CoSimulation([Accumulator("a", [])], [], 0.1, sub_rates={"c": 2, "a": 0})
    with pytest.raises(CouplingSetupError, match="sub-rate of 'a' is True, allowed: a whole number"):
        CoSimulation([Accumulator("a", [])], [], 0.1, sub_rates={"a": True})


# events and the end


def test_event_is_settled_and_told_with_its_time() -> None:
    class Valve(Accumulator):
        rounds = 0

        def update_discrete_states(self) -> bool:
            self.rounds += 1
            return self.rounds < 3

    valve = Valve("valve", [])
    valve.on_step = lambda time, step: (
        StepResult(Status.EARLY_RETURN, 0.14, "valve opens", event_handling_needed=True)
        if time < 0.14 < time + step
        else None
    )
    run, watcher = watched([valve], [])
    run.initialize()
    run.run(0.3)
    assert valve.rounds == 3
    assert [(event.time, event.text, event.source) for event in watcher.events] == [(0.14, "valve opens", "valve")]
    assert math.isclose(float(valve.output), 1.0)


def test_event_that_never_settles() -> None:
    class Chatter(Accumulator):
        def update_discrete_states(self) -> bool:
            return True

    relay = Chatter("relay", [])
    relay.on_step = lambda time, step: StepResult(Status.OK, time + step, event_handling_needed=True)
    run = CoSimulation([relay], [], 0.1)
    run.initialize()
    with pytest.raises(
        CoSimulationError, match=r"'relay' failed at 0.1 s: .*discrete states still change after 100 rounds"
    ):
        run.step()


def test_participant_may_end_the_run_without_a_failure() -> None:
    log: Log = []
    first, second = Accumulator("first", log), Accumulator("second", log)
    first.on_step = lambda time, step: (
        StepResult(Status.OK, time + step, "winch is empty", terminate_simulation=True) if time > 0.15 else None
    )
    run, watcher = watched([first, second], [])
    run.initialize()
    run.run(1.0)
    assert not run.is_running
    assert len(steps_of(log, "second")) == 3  # the step in which it was asked for is finished by everybody
    assert watcher.frames == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert watcher.reason == "first ends the run: winch is empty"
    assert log[-2:] == [("first", "terminate"), ("second", "terminate")]


@pytest.mark.parametrize("rolls_back", [False, True])
def test_one_that_has_asked_for_the_end_is_not_stepped_again(rolls_back: bool) -> None:
    """Neither in what its sub-rate leaves of the step, nor in the second half of a step that was repeated."""
    log: Log = []
    ender, stiff = Accumulator("ender", log), Accumulator("stiff", log)
    ender.on_step = lambda time, step: StepResult(
        Status.EARLY_RETURN, time + 0.5 * step, "done", terminate_simulation=True
    )
    stiff.on_step = refusing(0.06)
    run = CoSimulation([ender, stiff], [], 0.1, sub_rates={"ender": 2}, rolls_back=rolls_back)
    run.initialize()
    log.clear()
    run.step()
    assert not run.is_running
    assert steps_of(log, "ender") == ([(0.0, 0.05), (0.0, 0.025)] if rolls_back else [(0.0, 0.05)])
    assert steps_of(log, "stiff")[-1] == pytest.approx((0.05, 0.05))  # which makes the step whole


# discarded steps and rollback


def refusing(limit: float) -> Callable[[float, float], StepResult | None]:
    """Discards steps longer than `limit` [s]."""
    return lambda time, step: StepResult(Status.DISCARD, time, "too long") if step > limit else None


def test_discarded_step_is_halved_by_the_one_that_discards() -> None:
    log: Log = []
    stiff, other = Accumulator("stiff", log), Accumulator("other", log)
    stiff.on_step = refusing(0.03)
    run = CoSimulation([other, stiff], [Connection("other", "y", "stiff", "u")], 0.1)
    run.initialize()
    run.step()
    lengths = [length for _, length in steps_of(log, "stiff")]
    np.testing.assert_allclose(lengths, [0.1, 0.05, 0.025, 0.025, 0.025, 0.025], atol=1e-15)
    assert len(steps_of(log, "other")) == 1
    assert float(stiff.output) == pytest.approx(1.1, abs=1e-14)


def test_discarded_step_is_repeated_by_all_in_a_run_that_rolls_back() -> None:
    # y1' = y2, y2' = y1 by Gauss-Seidel with the step H / 2 twice: y1 += h y2; y2 += h y1(new)
    log: Log = []
    first, second = Accumulator("first", log), Accumulator("second", log)
    second.on_step = refusing(0.06)
    ring = [Connection("first", "y", "second", "u"), Connection("second", "y", "first", "u")]
    run = CoSimulation([first, second], ring, 0.1, rolls_back=True)
    run.initialize()
    run.step()
    y1 = y2 = 1.0
    for _ in range(2):
        y1 += 0.05 * y2
        y2 += 0.05 * y1
    assert (float(first.output), float(second.output)) == pytest.approx((y1, y2), abs=1e-15)
    assert run.rollback_faults == {}
    assert run.communication_point.index == 1


class Counted(GaussSeidel):
    """Remembers how many steps it has begun."""

    STATE = ("begun",)
    begun = 0

    def step(self, steppers: Steppers, links: Sequence[Link], begin: float, end: float) -> None:
        self.begun += 1
        super().step(steppers, links, begin, end)


class Opened(ExchangeLedger):
    """Keeps account of the steps that were opened."""

    STATE = ("opened",)
    opened = 0

    def open(self, steppers: Steppers) -> None:
        self.opened += 1
        super().open(steppers)


def test_algorithm_and_ledger_go_back_with_the_participants() -> None:
    """A whole step is discarded and two halves stand; then the run goes back to a saved state, and makes the same again."""
    stiff = Accumulator("stiff", [])
    stiff.on_step = refusing(0.06)
    algorithm, ledger = Counted(), Opened((), 0.1)
    run = CoSimulation([stiff], [], 0.1, rolls_back=True, exchange=Exchange(algorithm, ledger))
    run.initialize()
    run.step()
    assert (algorithm.begun, ledger.opened) == (2, 2)
    saved = run.save_state()
    for _ in range(2):
        run.step()
        assert (algorithm.begun, ledger.opened) == (4, 4)
        run.restore_state(saved)


def test_end_and_events_of_a_kept_half_outlive_the_rollback_of_the_other() -> None:
    """`ender` ends in the first half of the step; `stiff` discards the whole step, and then the second half."""

    class Valve(Accumulator):
        def update_discrete_states(self) -> bool:
            return False

    log: Log = []
    ender, stiff = Valve("ender", log), Accumulator("stiff", log)
    ender.on_step = lambda time, step: StepResult(
        Status.OK, time + step, "full", event_handling_needed=True, terminate_simulation=True
    )
    stiff.on_step = lambda time, step: (
        StepResult(Status.DISCARD, time, "too long") if step > (0.06 if time < 0.04 else 0.03) else None
    )
    run, watcher = watched([ender, stiff], [], rolls_back=True)
    run.initialize()
    log.clear()
    run.step()
    assert steps_of(log, "ender") == [(0.0, 0.1), (0.0, 0.05)]
    np.testing.assert_allclose(steps_of(log, "stiff")[-2:], [(0.05, 0.025), (0.075, 0.025)], atol=1e-15)
    assert [(event.time, event.text) for event in watcher.events] == [(0.05, "full")]
    assert watcher.reason == "ender ends the run: full"


@pytest.mark.parametrize("rolls_back", [False, True])
def test_step_that_is_always_discarded_ends_the_run_by_name(rolls_back: bool) -> None:
    stuck = Accumulator("stuck", [])
    run = CoSimulation([Accumulator("other", []), stuck], [], 0.1, rolls_back=rolls_back)
    run.initialize()
    stuck.on_step = refusing(0.0)
    with pytest.raises(
        CoSimulationError, match=r"'stuck' failed at 0 s: discard: too long, down to a step of 9\.77e-05 s"
    ):
        run.step()


def test_rollback_is_tested_withheld_and_named() -> None:
    """Participants that cannot go back are named before they have made a step."""

    class Refusing(Accumulator):
        def restore_state(self, state: object) -> None:
            raise OSError("no disk")

    log: Log = []
    good, bad, none = Accumulator("good", log), Refusing("bad", log), Function("none", lambda u: u)
    run, watcher = watched([good, bad, none], [], rolls_back=True)
    run.initialize()
    assert run.rollback_faults == {
        "bad": "its state cannot be restored: no disk",
        "none": "it cannot save its state",
    }
    assert watcher.events[0].text == "participant 'bad' cannot be rolled back: its state cannot be restored: no disk"
    assert watcher.events[0].level == "warning"
    good.on_step = refusing(0.06)
    log.clear()
    run.step()  # the one that discards takes smaller steps by itself, nobody is rolled back
    assert len(steps_of(log, "good")) == 3 and steps_of(log, "bad") == [(0.0, 0.1)]


def test_one_that_does_not_come_back_ends_the_run() -> None:
    """It has been stepped, and is no longer where the run begins."""

    class Forgetful(Accumulator):
        """Restores its output, but not how often it has stepped, on which the next output depends."""

        count = 0

        def do_step(self, time: float, step_size: float) -> StepResult:
            self.count += 1
            self.input = np.array(float(self.count))
            return super().do_step(time, step_size)

    log: Log = []
    run = CoSimulation([Accumulator("good", log), Forgetful("bad", log)], [], 0.1, rolls_back=True)
    message = (
        "restore_state leaves something out: the output 'y' of a repeated step differs by up to 0.1, allowed: equality"
    )
    with pytest.raises(CoSimulationError, match=f"'bad' failed at 0 s: {message}"):
        run.initialize()
    assert log[-1] == ("bad", "terminate")


@pytest.mark.parametrize("number", [np.int64, np.float64, np.bool_, complex])
def test_numbers_of_every_kind_are_compared(number: Callable[[int], object]) -> None:
    """Outputs of the repeated step are the same; a number in the state tells that its memory is not."""

    class Forgetful(Accumulator):
        count = 0

        def do_step(self, time: float, step_size: float) -> StepResult:
            self.count += 1
            return super().do_step(time, step_size)

        def save_state(self) -> object:
            return {"own": super().save_state(), "odd": number(self.count % 2)}

        def restore_state(self, state: object) -> None:
            super().restore_state(state["own"])  # type: ignore[index]

    run = CoSimulation([Forgetful("bad", [])], [], 0.1, rolls_back=True)
    with pytest.raises(CoSimulationError, match="the saved states after a step and after its repetition differ"):
        run.initialize()


@pytest.mark.parametrize("call", ["save_state", "restore_state"])
def test_state_that_is_not_given_or_taken_later_is_named(call: str) -> None:
    def refuse(*arguments: object) -> object:
        raise OSError("no disk")

    first, stiff = Accumulator("first", []), Accumulator("stiff", [])
    stiff.on_step = refusing(0.06)
    run = CoSimulation([first, stiff], [], 0.1, rolls_back=True)
    run.initialize()
    setattr(first, call, refuse)
    verb = {"save_state": "saved", "restore_state": "restored"}[call]
    with pytest.raises(CoSimulationError, match=f"'first' failed at 0 s: its state cannot be {verb}: no disk"):
        run.step()


def test_run_is_as_if_never_tested() -> None:
    results = []
    for rolls_back in (False, True):
        log: Log = []
        first, second = Accumulator("first", log), Accumulator("second", log)
        ring = [Connection("first", "y", "second", "u"), Connection("second", "y", "first", "u")]
        run = CoSimulation([first, second], ring, 0.1, rolls_back=rolls_back, exchange=Exchange(Jacobi()))
        run.initialize()
        run.run(1.0)
        results.append((float(first.output), float(second.output)))
    assert results[0] == results[1]


# initial values


def test_chain_against_the_order_of_connections_is_carried_to_its_end() -> None:
    parts = [Function(f"f{n}", lambda u: u + 1.0) for n in range(5)]
    connections = [Connection(f"f{n}", "y", f"f{n + 1}", "u") for n in reversed(range(4))]
    run = CoSimulation(parts, connections, 0.1)
    run.initialize()
    assert float(parts[4].get("y")[0]) == 5.0


def test_linear_loop_is_solved_though_sweeps_alone_diverge() -> None:
    # u = A y + b, y = u with spectral radius above 1: u = (1 - A)^-1 b
    matrix, constant = np.array([[0.3, -2.5], [1.8, 0.4]]), np.array([1.0, -2.0])
    assert np.abs(np.linalg.eigvals(matrix)).max() > 1.5
    parts = [Function("plant", lambda u: matrix @ u + constant, 2), Function("wire", lambda u: u, 2)]
    run = CoSimulation(parts, [Connection("plant", "y", "wire", "u"), Connection("wire", "y", "plant", "u")], 0.1)
    run.initialize()
    np.testing.assert_allclose(parts[0].input, np.linalg.solve(np.eye(2) - matrix, constant), rtol=1e-9)


def test_loop_of_an_array_is_solved_though_its_modes_are_of_all_sizes() -> None:
    # y = A y + 1: the differences of the calls differ by more than those of solvers that stop at a tolerance may
    matrix = np.diag([2.0, 1.5, 0.5, -1.0, -3.0, 0.9])
    parts = [Function("plant", lambda u: matrix @ u + 1.0, 6), Function("wire", lambda u: u, 6)]
    run = CoSimulation(parts, [Connection("plant", "y", "wire", "u"), Connection("wire", "y", "plant", "u")], 0.1)
    run.initialize()
    np.testing.assert_allclose(parts[0].input, 1.0 / (1.0 - np.diag(matrix)), rtol=1e-9)


def test_nonlinear_loop_is_solved() -> None:
    # x = cos x
    parts = [Function("cosine", np.cos), Function("wire", lambda u: u)]
    run = CoSimulation(parts, [Connection("cosine", "y", "wire", "u"), Connection("wire", "y", "cosine", "u")], 0.1)
    run.initialize()
    assert float(parts[0].input[0]) == pytest.approx(0.7390851332151607, rel=1e-9)


def test_loop_without_a_solution_is_named() -> None:
    parts = [Function("up", lambda u: u + 1.0), Function("wire", lambda u: u)]
    run = CoSimulation(parts, [Connection("up", "y", "wire", "u"), Connection("wire", "y", "up", "u")], 0.1)
    with pytest.raises(CoSimulationError, match="loop that does not converge: up:y -> wire:u, wire:y -> up:u"):
        run.initialize()


def test_loops_of_different_size_are_each_solved_to_their_own() -> None:
    # A = 0.5 A + 1e6, C = 0.9 C + 1e-4
    parts = [Function("A", lambda u: 0.5 * u + 1e6), Function("B", lambda u: u)]
    parts += [Function("C", lambda u: 0.9 * u + 1e-4), Function("D", lambda u: u)]
    pairs = (("A", "B"), ("B", "A"), ("C", "D"), ("D", "C"))
    run = CoSimulation(parts, [Connection(source, "y", target, "u") for source, target in pairs], 0.1)
    run.initialize()
    assert float(run.outputs("A")["y"][0]) == pytest.approx(2e6, rel=1e-9)
    assert float(run.outputs("C")["y"][0]) == pytest.approx(1e-3, rel=1e-9)


def test_small_loop_through_the_participant_of_a_large_one_is_solved_to_its_own() -> None:
    # p = 1e9 + 0.05 p, r = 1e-6 + 0.81 r: fifteen digits apart
    hub = Function("hub", lambda u: (1e9 + 0.1 * u[0], 1e-6 + 0.9 * u[1]), 2)
    hub.variables = variable_table(
        [
            Variable(name, "1", (1,), causality)
            for names, causality in ((("q", "s"), Causality.INPUT), (("p", "r"), Causality.OUTPUT))
            for name in names
        ]
    )
    places = {"q": 0, "s": 1, "p": 0, "r": 1}

    def take(name: str, value: Array) -> None:
        hub.input[places[name]] = value[0]

    hub.set = take  # type: ignore[method-assign]
    hub.get = lambda name: np.array([hub.function(hub.input)[places[name]]])  # type: ignore[method-assign,index]
    large, small = Function("large", lambda u: 0.5 * u), Function("small", lambda u: 0.9 * u)
    run = CoSimulation(
        [hub, large, small],
        [
            Connection("hub", "p", "large", "u"), Connection("large", "y", "hub", "q"),
            Connection("hub", "r", "small", "u"), Connection("small", "y", "hub", "s"),
        ],
        0.1,
    )  # fmt: skip
    run.initialize()
    assert float(run.outputs("hub")["p"][0]) == pytest.approx(1e9 / 0.95, rel=1e-9)
    assert float(run.outputs("hub")["r"][0]) == pytest.approx(1e-6 / 0.19, rel=1e-9)


def test_small_difference_of_large_values_in_a_loop_settles() -> None:
    # u = 0.7 u + 0.3e6 through a third value u - 1e6, which is 0 but for rounding
    parts = [Function("up", lambda u: 0.7 * u + 0.3e6), Function("less", lambda u: u - 1e6)]
    parts += [Function("more", lambda u: u + 1e6)]
    pairs = (("up", "less"), ("less", "more"), ("more", "up"))
    run = CoSimulation(parts, [Connection(source, "y", target, "u") for source, target in pairs], 0.1)
    run.initialize()
    assert float(run.outputs("up")["y"][0]) == pytest.approx(1e6, rel=1e-9)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_initial_value_that_is_not_finite_is_found_with_its_owner(value: float) -> None:
    parts = [Function("last", lambda u: u), Function("next", lambda u: u), Function("source", lambda u: value)]
    connections = [Connection("source", "y", "next", "u"), Connection("next", "y", "last", "u")]
    run = CoSimulation(parts, connections, 0.1)
    with pytest.raises(
        CoSimulationError, match=rf"'source' failed at 0 s: the output 'y' is \[{value}\], allowed: finite"
    ):
        run.initialize()


# units


def test_units_are_converted_where_both_are_known() -> None:
    log, knots, metres = [], Unit((0, 1, -1, 0, 0, 0, 0, 0), 1852.0 / 3600.0), Accumulator("winch", [], unit="m/s")
    pilot = Accumulator("pilot", log, unit="kn")
    pilot.output = np.array(2.0)
    own = Accumulator("own", log, unit="Knoten")
    own.variables = variable_table([Variable("y", "Knoten", (), Causality.OUTPUT, si=knots)])
    for source in (pilot, own):
        source.output = np.array(2.0)
        run = CoSimulation([source, metres], [Connection(source.name, "y", "winch", "u")], 0.1)
        run.initialize()
        assert float(metres.input) == pytest.approx(2.0 * 1852.0 / 3600.0, rel=1e-15)


@pytest.mark.parametrize("units", [("kn", "N"), ("Knoten", "m/s"), ("rad/s", "Hz"), ("N, N m", "N m, N")])
def test_units_that_do_not_fit_are_refused(units: tuple[str, str]) -> None:
    source, target = Accumulator("a", [], unit=units[0]), Accumulator("b", [], unit=units[1])
    with pytest.raises(CouplingSetupError, match=r"a:y -> b:u: unit '.*' feeds unit '.*', allowed: equal units, or"):
        CoSimulation([source, target], [Connection("a", "y", "b", "u")], 0.1)
