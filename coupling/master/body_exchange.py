"""The exchange between bodies and a fluid: the scheme for each body's motion and wrench, chosen by the body's mass.

The liquid that a body sets in motion (added mass A) resists its acceleration. If that resistance is exchanged a step late, this is a
fixed-point iteration of gain A / M, which diverges for bodies lighter than the liquid they move. Therefore the fluid's pressure solve
lets a body answer with an inverse mass W, beside the acceleration b that it has without the fluid's wrench F: a = b + W F. The schemes,
by what a participant offers:

monolithic    the participant gives both (`inverse_mass`, `free_acceleration`: FMI's directional derivative): stable for the lightest
              bodies, without iteration
explicit      W = 0, b = 0; for bodies of a stability number max eig(M^-1 A) below EXPLICIT_LIMIT, which is the relative error of forces
virtual mass  W = M^-1, and b from the body's last step, b = a - W F. The pressure solve accounts for the liquid that moves along, at its
              present position. Other forces on the body arrive a step late, and a joint that makes the body heavier, M' > M, is an
              iteration of gain (1 - M / M') A / (M + A) < 1: stable without a rollback
iterated      the same, and the step is rolled back and repeated until b is the one that the body shows, b = H(b), by quasi-Newton or
              Aitken iteration; needs rollback of fluid and body

If M is unknown, W is measured: the body alone makes each step seven times with a little more of one force or torque, and is rolled back.

Virtual mass takes the smaller one of the last two steps' b, entry by entry, and 0 if they differ in sign: an impact is not expected to
repeat. Conventions and variable names are those of `coupling.participants.fluid`.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from coupling.master.algorithms import Aitken, Algorithm, Iteration, QuasiNewton, Steppers, transfer
from coupling.master.connection import Link
from coupling.master.errors import CoSimulationError
from oilsim.backend.arrays import Array
from oilsim.core.physical_constants import GRAVITY

__all__ = ["Aitken", "BodyExchange", "BodyInterface", "QuasiNewton", "Scheme"]


EXPLICIT_LIMIT = 0.1  # where a lagged exchange diverges it is 1
LARGEST_NUMBER_OF_ITERATIONS = 40
ACCELERATION_TOLERANCE = 1e-2  # error of an acceleration, of the largest one or of GRAVITY if that is more
PROBE = 0.05  # of gravity, and of a radian in a step: what W is measured with
LEAST_PROBE = 1e-6  # of the weight of the liquid moved along, in N and in N m
TINY = 1e-30
NAMED = 4  # bodies that are told one by one


class Scheme(Enum):
    """The schemes by which a body is coupled; see the module."""

    MONOLITHIC = "inside the pressure solve"
    EXPLICIT = "explicit"
    ITERATED = "iterated"
    VIRTUAL_MASS = "virtual mass"


def require_scheme(what: str, scheme: object) -> None:
    """Raise TypeError, naming `what`, for anything but a `Scheme` or None."""
    if scheme is not None and not isinstance(scheme, Scheme):
        raise TypeError(f"{what} is {scheme!r}, allowed: None, {', '.join(map(str, Scheme))}")


@dataclass(frozen=True, kw_only=True)
class BodyInterface:
    """A body that meets a fluid.

    body: its name in the variables `<body>.pose`, `.twist`, `.wrench` of both participants.
    fluid, solver: names of the fluid's participant and of the body's.
    added_mass: returns A (6, 6) [kg, kg m, kg m2] of the fully submerged body, world frame, as `FluidParticipant.added_mass` does.
    mass_matrix: returns M (6, 6) [kg, kg m2] now, world frame; None if it is unknown, which needs rollback of the body.
    gravity: acceleration [m/s2] that the body is expected to have without the fluid in its first step.
    scheme: None to let it be chosen; TypeError for anything else that is not a `Scheme`.
    """

    body: str
    fluid: str
    solver: str
    added_mass: Callable[[], Array]
    mass_matrix: Callable[[], Array] | None = None
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    scheme: Scheme | None = None

    def __post_init__(self) -> None:
        require_scheme(f"scheme of body {self.body!r}", self.scheme)


class BodyExchange(Algorithm):
    """The algorithm for bodies in a fluid: Gauss-Seidel, except that the fluid and its iterated bodies step together, repeatedly.

    `iteration` creates the iteration of a step from its first relaxation factor. Aitken's tolerates the noise of a fluid whose pressure
    solve stops at a tolerance; quasi-Newton needs fewer rounds for many bodies and a tighter tolerance. Raises ValueError for several
    fluids.
    """

    STATE = ("_free", "_wrenches", "_probes")

    def __init__(
        self, interfaces: Sequence[BodyInterface], *, iteration: Callable[[float], Iteration] = Aitken
    ) -> None:
        fluids = {interface.fluid for interface in interfaces}
        if len(fluids) > 1:
            raise ValueError(f"the bodies meet the fluids {', '.join(sorted(fluids))}, allowed: one fluid")
        self._interfaces = {interface.body: interface for interface in interfaces}
        self._iteration = iteration
        self._schemes: dict[str, Scheme] = {}
        self._numbers: dict[str, float] = {}
        self._with_mobility: set[str] = set()  # bodies that tell how they answer an impulse
        self._liquid_weights: dict[str, float] = {}  # [N] of what each body moves along, all under
        self._probes: dict[str, Array] = {}  # (6,) forces and torques that W is measured with
        self._wrenches: dict[str, Array] = {}  # (6,) F of the last step
        self._free: dict[str, Array] = {}  # (2, 6) b of the last two steps, the later one first
        self.iterations = 0  # of the last step
        self.unsettled = 0  # steps whose iteration did not come to its tolerance

    @property
    def schemes(self) -> Mapping[str, Scheme]:
        """The scheme of every body, by name; known once the run has begun."""
        return dict(self._schemes)

    @property
    def interfaces(self) -> tuple[BodyInterface, ...]:
        """The bodies in the order in which they were given."""
        return tuple(self._interfaces.values())

    @property
    def stability_numbers(self) -> Mapping[str, float]:
        """Largest ratio of added mass (fully submerged) to mass of every body, by name; NaN if its mass is unknown."""
        return dict(self._numbers)

    def prepare(self, steppers: Steppers, links: Sequence[Link]) -> Sequence[str]:
        """Find out how light the bodies are, and which of them give their inverse mass; see `Algorithm.prepare`."""
        fed = {(link.connection.target, link.connection.target_variable) for link in links}
        names: dict[str, None] = {}
        for body, interface in self._interfaces.items():
            mass = interface.mass_matrix
            added = interface.added_mass()
            self._numbers[body] = stability_number(added, mass()) if mass is not None else np.nan
            self._liquid_weights[body], self._wrenches[body] = GRAVITY * added[:3, :3].trace(), np.zeros(6)
            self._free[body] = np.tile((*interface.gravity, 0.0, 0.0, 0.0), (2, 1))
            if {(interface.fluid, "inverse_mass"), (interface.fluid, f"{body}.inverse_mass")} & fed:
                self._with_mobility.add(body)
            scheme = _choose(interface, body in self._with_mobility, self._numbers[body], {})
            names |= dict.fromkeys(_rolled_back(interface, scheme))
        return tuple(names)

    def begin(self, faults: Mapping[str, str]) -> Sequence[str]:
        """Choose a scheme for every body and return messages about it; CoSimulationError if there is none. See `Algorithm.begin`."""
        for body, interface in self._interfaces.items():
            self._schemes[body] = _choose(interface, body in self._with_mobility, self._numbers[body], faults)
        return [self._told(scheme) for scheme in Scheme if scheme in self._schemes.values()]

    def step(self, steppers: Steppers, links: Sequence[Link], begin: float, end: float) -> None:
        """Make one communication step; see `Algorithm.step`."""
        step = _Step(steppers, links, begin, end)
        iterated = self._coupled(Scheme.ITERATED)
        together = [*dict.fromkeys([i.fluid for i in iterated] + [i.solver for i in iterated])]
        self.iterations = 1
        mobilities = [self._mobility(interface, step) for interface in self._coupled(Scheme.VIRTUAL_MASS)]
        for mobility in mobilities:
            mobility.tell(_lasting(self._free[mobility.body]))
        for name in steppers:
            if name not in together:
                step.make(name)
            elif name == together[0]:
                self._iterate(iterated, together, step)
        self._remember(mobilities)

    def _coupled(self, scheme: Scheme) -> list[BodyInterface]:
        return [interface for body, interface in self._interfaces.items() if self._schemes[body] is scheme]

    def _mobility(self, interface: BodyInterface, step: _Step) -> _Mobility:
        """Return how the body answers in the step that begins, as given by it or measured."""
        if interface.mass_matrix is None:
            return _Mobility(interface, self._measured(interface, step), step)
        return _Mobility(interface, np.asarray(np.linalg.inv(interface.mass_matrix()), np.float64), step)

    def _measured(self, interface: BodyInterface, step: _Step) -> Array:
        """Measure W (6, 6) by differences that are small for the body, with the probes of the first step."""
        body, wrench = interface.body, self._wrenches[interface.body]
        if body not in self._probes:
            least = np.full(6, LEAST_PROBE * self._liquid_weights[body])
            mobility = _differences(interface, wrench, least, step)
            wanted = np.repeat([PROBE * GRAVITY, PROBE / step.duration**2], 3)
            self._probes[body] = np.clip(wanted / np.maximum(mobility.diagonal(), TINY), least, least / LEAST_PROBE)
        return _differences(interface, wrench, self._probes[body], step)

    def _remember(self, mobilities: Sequence[_Mobility]) -> None:
        """Remember what the bodies showed in this step."""
        for mobility in mobilities:
            self._wrenches[mobility.body] = mobility.wrench
            self._free[mobility.body] = np.stack([mobility.free_acceleration(), self._free[mobility.body][0]])

    def _iterate(self, bodies: Sequence[BodyInterface], order: Sequence[str], step: _Step) -> None:
        """Repeat the step of the fluid and the iterated bodies until the bodies show the b that the step assumes.

        An impact makes H jump, and there may be no solution b; then the last round uses the best b that was tried.
        """
        start = {name: step.steppers[name].save() for name in order}
        mobilities = [self._mobility(interface, step) for interface in bodies]
        weights = np.concatenate([_weights(interface) for interface in bodies])
        iteration = self._iteration(1.0)
        assumed = np.concatenate([self._free[i.body][0] for i in bodies])
        tried: list[tuple[float, Array]] = []  # error [m/s2], which is how far the iteration would go on, and b
        while True:
            for mobility, free in zip(mobilities, assumed.reshape(-1, 6), strict=True):
                mobility.tell(free)
            for name in order:
                step.make(name)
            shown = np.concatenate([mobility.free_acceleration() for mobility in mobilities])
            proposal = iteration.proposal(assumed, shown - assumed, 1.0 / weights)
            error = float((weights * np.abs(proposal - assumed)).max())
            allowed = ACCELERATION_TOLERANCE * max(float((weights * np.abs(assumed)).max()), GRAVITY)
            tried.append((error, assumed))
            if error <= allowed or len(tried) > LARGEST_NUMBER_OF_ITERATIONS:
                break
            is_last = len(tried) == LARGEST_NUMBER_OF_ITERATIONS
            assumed = min(tried, key=lambda one: one[0])[1] if is_last else proposal
            for name in order:
                step.steppers[name].restore(start[name])
        self.iterations = len(tried)
        if error > allowed:
            self._note_unsettled(error, allowed, step.begin)
        self._remember(mobilities)

    def _note_unsettled(self, error: float, allowed: float, time: float) -> None:
        """Count a step that stands although its iteration has not reached its tolerance, and warn the first time."""
        self.unsettled += 1
        if self.unsettled == 1:
            warnings.warn(
                f"the exchange of bodies does not converge in {LARGEST_NUMBER_OF_ITERATIONS} rounds at {time:.6g} s, as in an impact;"
                f" acceleration error {error:.3g} m/s2, allowed: {allowed:.3g} m/s2; such steps stand, and the ledger checks their energy",
                stacklevel=2,
            )

    def _told(self, scheme: Scheme) -> str:
        """Write which bodies are coupled by a scheme, with the range of their stability numbers."""
        bodies = [body for body, own in self._schemes.items() if own is scheme]
        numbers = [self._numbers[body] for body in bodies if np.isfinite(self._numbers[body])]
        span = f"added mass / mass {min(numbers):.2g} to {max(numbers):.2g}" if numbers else "added mass / mass unknown"
        named = ", ".join(bodies) if len(bodies) <= NAMED else f"{len(bodies)} bodies, {bodies[0]} to {bodies[-1]}"
        return f"coupled {scheme.value}: {named} ({span})"


@dataclass(frozen=True)
class _Step:
    """A communication step that is about to be made."""

    steppers: Steppers
    links: Sequence[Link]
    begin: float
    end: float

    @property
    def duration(self) -> float:
        """Duration of the step [s]."""
        return self.end - self.begin

    def make(self, name: str) -> None:
        """Feed a participant and bring it to the end of the step."""
        transfer([link for link in self.links if link.connection.target == name], self.steppers)
        self.steppers[name].advance(self.begin, self.end)


class _Mobility:
    """The answer of one body to the fluid in a step, which may be made repeatedly."""

    def __init__(self, interface: BodyInterface, inverse_mass: Array, step: _Step) -> None:
        self.body, self._duration, self._inverse_mass = interface.body, step.duration, inverse_mass
        self._fluid, self._solver = step.steppers[interface.fluid], step.steppers[interface.solver]
        self._begin = self._solver.outputs[f"{self.body}.twist"]

    def tell(self, free: Array) -> None:
        """Give the fluid W and b."""
        self._fluid.set(f"{self.body}.inverse_mass", self._inverse_mass)
        self._fluid.set(f"{self.body}.free_acceleration", free)

    @property
    def wrench(self) -> Array:
        """The wrench F (6,) that the body was fed."""
        return self._solver.inputs[f"{self.body}.wrench"]

    def free_acceleration(self) -> Array:
        """Return b (6,) that the body has shown: the part of its acceleration that the wrench does not explain."""
        acceleration = (self._solver.outputs[f"{self.body}.twist"] - self._begin) / self._duration
        return np.asarray(acceleration - self._inverse_mass @ self.wrench)


def _differences(interface: BodyInterface, wrench: Array, more: Array, step: _Step) -> Array:
    """Measure W (6, 6): the body alone makes the step and is rolled back, under `wrench` (6,) and with each entry of `more` (6,) added."""
    solver, body = step.steppers[interface.solver], interface.body
    start, twists = solver.save(), []
    for added in (np.zeros(6), *np.diag(more)):
        solver.set(f"{body}.wrench", wrench + added)
        solver.advance(step.begin, step.end)
        twists.append(solver.outputs[f"{body}.twist"])
        solver.restore(start)
    mobility = (np.array(twists[1:]) - twists[0]) / (more[:, None] * step.duration)
    values, vectors = np.linalg.eigh(0.5 * (mobility + mobility.T))
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)


def _lasting(free: Array) -> Array:
    """Return the smaller (6,) of the two rows of `free` (2, 6), 0 where they differ in sign."""
    smaller = np.minimum(np.abs(free[0]), np.abs(free[1]))
    return np.asarray(np.where(free[0] * free[1] > 0.0, np.copysign(smaller, free[0]), 0.0))


def _choose(interface: BodyInterface, gives_mobility: bool, number: float, faults: Mapping[str, str]) -> Scheme:
    """Choose the requested scheme, or the first that is stable with what the participants offer; CoSimulationError if none is."""
    scheme = interface.scheme or _stable(interface, gives_mobility, number, faults)
    if scheme is Scheme.MONOLITHIC and not gives_mobility:
        message = (
            f"body {interface.body!r} cannot be coupled ({scheme.value}): {interface.fluid!r} does not get its inverse mass, allowed: "
            f"a connection to {interface.body}.inverse_mass, or another scheme"
        )
        raise CoSimulationError(interface.fluid, 0.0, message)
    for name in _rolled_back(interface, scheme):
        if name in faults:
            message = (
                f"body {interface.body!r} cannot be coupled ({scheme.value}): {name!r} cannot be rolled back ({faults[name]}), "
                "allowed: a participant that can, or one that gives the body's mass or inverse_mass"
            )
            raise CoSimulationError(name, 0.0, message)
    return scheme


def _stable(interface: BodyInterface, gives_mobility: bool, number: float, faults: Mapping[str, str]) -> Scheme:
    if gives_mobility:
        return Scheme.MONOLITHIC
    if number < EXPLICIT_LIMIT:
        return Scheme.EXPLICIT
    is_known = interface.mass_matrix is not None
    return Scheme.VIRTUAL_MASS if is_known or interface.fluid in faults else Scheme.ITERATED


def _rolled_back(interface: BodyInterface, scheme: Scheme) -> tuple[str, ...]:
    """Return the participants whose steps a scheme repeats."""
    if scheme is Scheme.ITERATED:
        return interface.fluid, interface.solver
    is_measured = scheme is Scheme.VIRTUAL_MASS and interface.mass_matrix is None
    return (interface.solver,) if is_measured else ()


def _weights(interface: BodyInterface) -> Array:
    """Return the weights (6,) that make angular accelerations [rad/s2] comparable with linear ones [m/s2]: radii of gyration [m]."""
    if interface.mass_matrix is None:
        return np.ones(6)
    diagonal = np.diag(interface.mass_matrix())
    return np.concatenate([np.ones(3), np.sqrt(diagonal[3:] / diagonal[:3].mean())])


def stability_number(added: Array, mass_matrix: Array) -> float:
    """Return the largest eigenvalue of M^-1 A [1], A and M (6, 6): a lagged exchange of forces diverges above 1."""
    return float(np.abs(np.linalg.eigvals(np.linalg.solve(mass_matrix, added))).max())
