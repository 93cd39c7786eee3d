"""Bodies and a fluid under one roof: how each body's motion and wrench are exchanged, chosen by how light it is.

The liquid that a body sets moving (added mass A) resists its acceleration. Exchanged a step late, that resistance is a fixed-point
iteration of gain A / M, which diverges for bodies lighter than the liquid they move. Schemes, by what a participant offers:

monolithic    it tells how the body answers an impulse (`inverse_mass`, `free_acceleration`: FMI's directional derivative), and
              the body answers inside the fluid's pressure solve: stable for the lightest, no iteration
explicit      one exchange a step; for bodies of stability number max eig(M^-1 A) below EXPLICIT_LIMIT
iterated      the step is taken back and repeated until the fluid has seen the acceleration a that the body makes of its wrench,
              a = H(a), by quasi-Newton or Aitken iteration; needs rollback of fluid and body
virtual mass  the body carries A besides its own mass, and gets back A times its last acceleration. Written without touching the
              body: (M + A) a = F + F_other + A a_last with F_other = M a_last - F_sent_last gives

                  F_sent = F_sent_last + M (M + A)^-1 (F - F_sent_last),

              with A of the surface that is wetted now. Stable unless A is under half of what it should be. The impulse that is held
              back, H M^-1 A (F_sent - F_sent_first), stays bounded. Added mass is accurate, sudden loads arrive late.

Conventions and variable names are those of `coupling.participants.fluid`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt

from coupling.added_mass import stability_number
from coupling.algorithms import Steppers, transfer
from coupling.connection import Link
from coupling.errors import CoSimulationError
from coupling.fixed_point import Aitken, Iteration, QuasiNewton

__all__ = ["Aitken", "BodyExchange", "BodyInterface", "QuasiNewton", "Scheme"]

Array = npt.NDArray[np.float64]

EXPLICIT_LIMIT = 0.5  # half of where a lagged exchange diverges
LARGEST_NUMBER_OF_ITERATIONS = 40
ACCELERATION_TOLERANCE = 1e-2  # error of an acceleration, of the largest one or of STANDARD_GRAVITY if that is more
STANDARD_GRAVITY = 9.81
NAMED = 4  # bodies that are told one by one


class Scheme(Enum):
    """How one body is coupled; see the module."""

    MONOLITHIC = "inside the pressure solve"
    EXPLICIT = "explicit"
    ITERATED = "iterated"
    VIRTUAL_MASS = "virtual mass"


@dataclass(frozen=True, kw_only=True)
class BodyInterface:
    """One body that meets a fluid.

    body: its name in the variables `<body>.pose`, `.twist`, `.wrench` of both participants.
    fluid, solver: names of the fluid's participant and of the body's.
    added_mass: tells A (6, 6) of the surface wetted now, world frame, as `FluidParticipant.added_mass` does.
    mass_matrix: tells M (6, 6) now; None where nobody knows it, which leaves explicit and virtual mass out.
    scheme: None to let it be chosen.
    """

    body: str
    fluid: str
    solver: str
    added_mass: Callable[[], Array]
    mass_matrix: Callable[[], Array] | None = None
    scheme: Scheme | None = None


class BodyExchange:
    """Participants step in the given order, as in Gauss-Seidel; a fluid and its iterated bodies step together, repeatedly.

    `iteration` makes the iteration of a step from its first relaxation factor: Aitken's bears the noise of a fluid whose pressure
    solve stops at a tolerance, quasi-Newton needs fewer rounds for many bodies and a tighter tolerance.
    """

    def __init__(
        self, interfaces: Sequence[BodyInterface], *, iteration: Callable[[float], Iteration] = Aitken
    ) -> None:
        fluids = {interface.fluid for interface in interfaces}
        if len(fluids) > 1:
            raise ValueError(f"bodies meet the fluids {', '.join(sorted(fluids))}, allowed: one")
        self._interfaces = {interface.body: interface for interface in interfaces}
        self._iteration = iteration
        self._schemes: dict[str, Scheme] = {}
        self._numbers: dict[str, float] = {}
        self._answering: set[str] = set()  # bodies that tell how they answer an impulse
        self._sent: dict[str, Array] = {}
        self._accelerations: dict[str, Array] = {}
        self.iterations = 0  # of the last step

    @property
    def schemes(self) -> Mapping[str, Scheme]:
        """The scheme of every body, by name; known once the run has begun."""
        return dict(self._schemes)

    @property
    def interfaces(self) -> tuple[BodyInterface, ...]:
        """The bodies as they were given."""
        return tuple(self._interfaces.values())

    @property
    def stability_numbers(self) -> Mapping[str, float]:
        """Largest ratio of added mass to mass of every body, by name, as the run began; NaN where its mass is unknown."""
        return dict(self._numbers)

    def holds_back(self, body: str) -> bool:
        """Whether the body gets its impulses late by construction."""
        return self._schemes.get(body) is Scheme.VIRTUAL_MASS

    def prepare(self, steppers: Steppers, links: Sequence[Link]) -> Sequence[str]:
        """See `Algorithm.prepare`: finds out how light bodies are, and which of them answer impulses."""
        fed = {(link.connection.target, link.connection.target_variable) for link in links}
        names: dict[str, None] = {}
        for body, interface in self._interfaces.items():
            mass = interface.mass_matrix
            number = stability_number(interface.added_mass(), mass()) if mass is not None else np.nan
            self._numbers[body], self._accelerations[body] = number, np.zeros(6)
            if {(interface.fluid, "inverse_mass"), (interface.fluid, f"{body}.inverse_mass")} & fed:
                self._answering.add(body)
            if _choose(interface, body in self._answering, number, {}) is Scheme.ITERATED:
                names |= dict.fromkeys((interface.fluid, interface.solver))
        return tuple(names)

    def begin(self, faults: Mapping[str, str]) -> Sequence[str]:
        """See `Algorithm.begin`: chooses a scheme for every body and tells which."""
        for body, interface in self._interfaces.items():
            self._schemes[body] = _choose(interface, body in self._answering, self._numbers[body], faults)
        return [self._told(scheme) for scheme in Scheme if scheme in self._schemes.values()]

    def step(self, steppers: Steppers, links: Sequence[Link], begin: float, end: float) -> None:
        """See `Algorithm.step`."""
        iterated = [i for body, i in self._interfaces.items() if self._schemes[body] is Scheme.ITERATED]
        together = [*dict.fromkeys([i.fluid for i in iterated] + [i.solver for i in iterated])]
        self.iterations = 1
        for name, stepper in steppers.items():
            if name not in together:
                self._feed(name, steppers, links)
                stepper.advance(begin, end)
            elif name == together[0]:
                self._iterate(iterated, together, steppers, links, begin, end)

    def save(self) -> dict[str, dict[str, Array]]:
        """See `Algorithm.save`."""
        return {"sent": dict(self._sent), "accelerations": dict(self._accelerations)}

    def restore(self, state: Mapping[str, Mapping[str, Array]]) -> None:
        """See `Algorithm.restore`."""
        self._sent, self._accelerations = dict(state["sent"]), dict(state["accelerations"])

    def _feed(self, target: str, steppers: Steppers, links: Sequence[Link]) -> None:
        """Transfer to one participant; wrenches of bodies of virtual mass are held back in part."""
        feeding = [link for link in links if link.connection.target == target]
        transfer(feeding, steppers)
        for link in feeding:
            body = link.connection.target_variable.removesuffix(".wrench")
            if (
                self._schemes.get(body) is Scheme.VIRTUAL_MASS
                and link.connection.source == self._interfaces[body].fluid
            ):
                given = link.carried(steppers[link.connection.source].outputs[link.connection.source_variable])
                self._sent[body] = self._held_back(body, given)
                steppers[target].set(link.connection.target_variable, self._sent[body])

    def _held_back(self, body: str, given: Array) -> Array:
        """F_sent of the module's docstring."""
        interface = self._interfaces[body]
        assert interface.mass_matrix is not None  # else the scheme was refused
        mass, last = interface.mass_matrix(), self._sent.get(body, np.zeros(6))
        return np.asarray(last + mass @ np.linalg.solve(mass + interface.added_mass(), given - last))

    def _iterate(
        self,
        bodies: Sequence[BodyInterface],
        order: Sequence[str],
        steppers: Steppers,
        links: Sequence[Link],
        begin: float,
        end: float,
    ) -> None:
        """Repeat the step of the fluid and the iterated bodies until the accelerations that it assumes are those it makes.

        H(a) - a falls by 1 + A / M times the error of a, which is what counts.
        """
        start = {name: steppers[name].save() for name in order}
        twists = {i.body: steppers[i.solver].outputs[f"{i.body}.twist"] for i in bodies}
        weights = np.concatenate([_weights(interface) for interface in bodies])
        largest = max((self._numbers[i.body] for i in bodies if np.isfinite(self._numbers[i.body])), default=1.0)
        iteration = self._iteration(1.0 / (1.0 + largest))
        assumed = np.concatenate([self._accelerations[i.body] for i in bodies])
        sent = dict(self._sent)
        for count in range(1, LARGEST_NUMBER_OF_ITERATIONS + 1):
            self._sent = dict(sent)
            for interface, acceleration in zip(bodies, assumed.reshape(-1, 6), strict=True):
                steppers[interface.fluid].set(f"{interface.body}.free_acceleration", acceleration)
            for name in order:
                self._feed(name, steppers, links)
                steppers[name].advance(begin, end)
            made = [(steppers[i.solver].outputs[f"{i.body}.twist"] - twists[i.body]) / (end - begin) for i in bodies]
            residual = np.concatenate(made) - assumed
            scale = max(float(np.abs(weights * assumed).max()), STANDARD_GRAVITY)
            if np.abs(weights * residual).max() <= (1.0 + largest) * ACCELERATION_TOLERANCE * scale:
                self.iterations = count
                self._accelerations |= dict(zip((i.body for i in bodies), made, strict=True))
                return
            assumed = iteration.proposal(assumed, residual, 1.0 / weights)
            for name in order:
                steppers[name].restore(start[name])
        worst = int(np.argmax(np.abs(weights * residual)))
        error = float(np.abs(weights * residual)[worst]) / (1.0 + largest)
        message = (
            f"body {bodies[worst // 6].body!r}: exchange does not settle in {LARGEST_NUMBER_OF_ITERATIONS} iterations, error of "
            f"acceleration {error:.3g} m/s2, allowed: {ACCELERATION_TOLERANCE * scale:.3g}; the fluid's own tolerances may be too wide"
        )
        raise CoSimulationError(bodies[0].fluid, begin, message)

    def _told(self, scheme: Scheme) -> str:
        """Which bodies are coupled in a way, with the range of their stability numbers."""
        bodies = [body for body, own in self._schemes.items() if own is scheme]
        numbers = [self._numbers[body] for body in bodies if np.isfinite(self._numbers[body])]
        span = f"added mass / mass {min(numbers):.2g} to {max(numbers):.2g}" if numbers else "added mass / mass unknown"
        named = ", ".join(bodies) if len(bodies) <= NAMED else f"{len(bodies)} bodies, {bodies[0]} to {bodies[-1]}"
        return f"coupled {scheme.value}: {named} ({span})"


def _choose(interface: BodyInterface, answers: bool, number: float, faults: Mapping[str, str]) -> Scheme:
    """The scheme asked for, or the first that is stable with what participants offer; CoSimulationError if none is."""
    if interface.scheme is not None:
        return interface.scheme
    if answers:
        return Scheme.MONOLITHIC
    if number < EXPLICIT_LIMIT:
        return Scheme.EXPLICIT
    stuck = [name for name in (interface.fluid, interface.solver) if name in faults]
    if not stuck:
        return Scheme.ITERATED
    if interface.mass_matrix is not None:
        return Scheme.VIRTUAL_MASS
    raise CoSimulationError(
        interface.solver,
        0.0,
        f"body {interface.body!r} cannot be coupled: it tells neither inverse_mass nor its mass, and {stuck[0]!r} "
        f"cannot be taken back ({faults[stuck[0]]}), allowed: one of the three",
    )


def _weights(interface: BodyInterface) -> Array:
    """(6,) what makes angular accelerations [rad/s2] comparable with linear ones [m/s2]: radii of gyration [m]."""
    if interface.mass_matrix is None:
        return np.ones(6)
    diagonal = np.diag(interface.mass_matrix())
    return np.concatenate([np.ones(3), np.sqrt(diagonal[3:] / diagonal[:3].mean())])
