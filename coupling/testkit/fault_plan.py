"""The faults of a run: a plan of what fails when, which tells the run's log of each as it comes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.master.observer_dispatch import Observer
from coupling.master.participant import Participant, Status, StepResult
from coupling.testkit.faults import Fault, FaultyObserver, FaultyParticipant, require_fault
from oilsim.fluid.checks import finite

ON_PURPOSE = "fault on purpose"  # how the text of a planned fault's event begins


class FaultClock(Participant):
    """A participant that tells the run's log of every fault in the step that contains it, and lets lines part.

    name: "faults". words: the text of each fault's event, with its time [s]. partings: calls that let a line or a joint part, by time [s].
    """

    STATE = ()

    def __init__(
        self, words: Sequence[tuple[float, str]], partings: Sequence[tuple[float, Callable[[], None]]]
    ) -> None:
        super().__init__("faults")
        self._words, self._partings = sorted(words), partings

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Let lines part when it is time, and say what fails in this step."""
        end = time + step_size
        for at_time, part in self._partings:
            if time <= at_time < end:
                part()
        told = "; ".join(words for at_time, words in self._words if time <= at_time < end)
        return StepResult(Status.OK, end, told, event_handling_needed=bool(told), level="warning")

    def save_state(self) -> object:
        """Return nothing, which is all that is needed; NotImplementedError where a line parts, since it cannot be mended."""
        if self._partings:
            raise NotImplementedError("a line that parts on purpose cannot be mended")
        return None

    def restore_state(self, state: object) -> None:
        """Go back to any state; NotImplementedError as `save_state` does."""
        self.save_state()


@dataclass
class FaultPlan:
    """The faults of a run, stated before it begins.

    scene.faults.participant("fluid", Fault.NAN, at_time=0.1)
    scene.faults.line("tow", at_time=0.2)
    scene.faults.observer(Fault.EXCEPTION, at_time=0.3)
    """

    _of_participants: dict[str, list[tuple[Fault, float]]] = field(default_factory=dict)
    _of_lines: dict[str, float] = field(default_factory=dict)
    _of_observers: list[FaultyObserver] = field(default_factory=list)

    def participant(self, name: str, fault: Fault, *, at_time: float) -> None:
        """Let a participant fail in the step that contains `at_time` [s]; errors are those of `FaultyParticipant`."""
        require_fault(fault, at_time, tuple(Fault))
        self._of_participants.setdefault(name, []).append((fault, at_time))

    def line(self, name: str, *, at_time: float) -> None:
        """Let a line or a joint part at `at_time` [s]; ValueError for a time that is not finite."""
        finite("at_time of the parting line [s]", at_time)
        self._of_lines[name] = at_time

    def observer(self, fault: Fault, *, at_time: float) -> None:
        """Add a viewer that raises or stalls at `at_time` [s]; errors are those of `FaultyObserver`."""
        self._of_observers.append(FaultyObserver(fault, at_time=at_time))

    def __bool__(self) -> bool:
        """Tell whether anything is to fail."""
        return bool(self._of_participants or self._of_lines or self._of_observers)

    @property
    def why_not_kept(self) -> str:
        """Reason why a run with these faults cannot be saved; empty if it can."""
        return f"line {min(self._of_lines)!r} parts on purpose, which cannot be undone" if self._of_lines else ""

    def words(self) -> list[tuple[float, str]]:
        """Return time [s] and text of the event by which each fault is told."""
        told = [
            (at, f"{name!r}: {fault.value}") for name, all_of in self._of_participants.items() for fault, at in all_of
        ]
        told += [(at, f"line {name!r} parts") for name, at in self._of_lines.items()]
        told += [(one.at_time, f"a viewer: {one.fault.value}") for one in self._of_observers]
        return sorted((at, f"{ON_PURPOSE}: {text}") for at, text in told)

    def applied(self, participant: Participant) -> Participant:
        """Return what takes part in the participant's place."""
        for fault, at_time in self._of_participants.get(participant.name, ()):
            participant = FaultyParticipant(participant, fault, at_time=at_time)
        return participant

    def observers(self, observers: Sequence[Observer]) -> list[Observer]:
        """Return the observers of the run, those that fail last."""
        return [*observers, *self._of_observers]

    def clock(self, world: RigidBodyWorld | None) -> list[FaultClock]:
        """Return the participant that tells of the faults and lets lines part, which steps first; none without faults.

        Raises ValueError for an unknown line, or a line in a run without bodies.
        """
        if not self:
            return []
        known = () if world is None else (*world.lines.names, *world.joint_names)
        strange = sorted(set(self._of_lines) - set(known))
        if strange:
            raise ValueError(
                f"line {strange[0]!r} that is to part does not exist, allowed: {', '.join(known) or 'none'}"
            )
        partings = [] if world is None else [(at, partial(_part, world, line)) for line, at in self._of_lines.items()]
        return [FaultClock(self.words(), partings)]

    def require_met(self, names: Sequence[str]) -> None:
        """Refuse faults of participants that the run does not have; ValueError."""
        strange = sorted(set(self._of_participants) - set(names))
        if strange:
            raise ValueError(f"fault of {strange[0]!r}, which does not take part, allowed: {', '.join(names)}")


def _part(world: RigidBodyWorld, line: str) -> None:
    """Let a line or a joint part, unless it has parted before."""
    if line in world.lines.names:
        world.part_line(line)
    elif line in world.joint_names:
        world.part_joint(line)
