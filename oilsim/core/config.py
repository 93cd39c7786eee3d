"""The description of a fluid and of its solver: one frozen dataclass, which refuses impossible values at construction."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Literal, Protocol

from oilsim.core.phases import EXPLICIT_UP_TO, Phase, capillary_inertia, least_pressure
from oilsim.core.physical_constants import GRAVITY
from oilsim.core.quantity import is_number, quantities, quantity

Vector = tuple[float, float, float]
Scheme = Literal["split", "paper"]

# [1] relative rounding of a number of 32 bits; theory (IEEE 754); half a unit in the last of 24 binary places
ROUNDING = 2.0**-24
# [d] by which rounding may move a particle; tuned; not on record
COARSEST = 1e-3
# [d] from the origin, beyond which rounding moves particles by more than COARSEST; theory; COARSEST over ROUNDING
FURTHEST = math.floor(COARSEST / ROUNDING)
# [m/s2] largest component of gravity; numerical; a hundred times that of the Earth, as in a centrifuge
HARDEST_PULL = 1000.0
# [s] least time step that can be asked for; numerical; sound passes a spacing of 1 mm in 1e-6 s
SHORTEST_STEP = 1e-9
# [1] largest limit on iterations that can be asked for; numerical; a solve that has not ended by then will not
MOST_ITERATIONS = 1_000_000
VECTORS = ("gravity", "lower", "upper")
MAY_BE_NONE = ("maximum_time_step",)


def _are_three(values: Any, fit: Callable[[Any], bool]) -> bool:
    return isinstance(values, Iterable) and len(members := tuple(values)) == 3 and all(fit(value) for value in members)


# [d] length of the shortest wave that particles carry; measured; shorter ones lose their height within a few periods
SHORTEST_WAVE = 8.0
# [1] steps in that wave's period; measured; the 10 ms at 5 cm that waves and floating bodies were validated with
STEPS_A_PERIOD = 50.0
# [1] share of the lattice's limit that is used; measured; disorder makes some particles swing faster
STABLE = 0.9


def swing_time_step(spacing: float, dimension: int, head: float) -> float:
    """Return the longest step [s] in which particles swing stably under a pressure over density `head` [m2/s2]; spacing d [m].

    See `oilsim.fluid.time_step`.
    """
    # here, since a fluid is described without compiled code
    from oilsim.neighborhood.smoothing_kernels import lattice_stiffness

    return STABLE * 2.0 * spacing / math.sqrt(lattice_stiffness(dimension) * head) if head > 0.0 else math.inf


def swing_head(spacing: float, dimension: int, time_step: float) -> float:
    """Return the pressure over density [m2/s2] under which particles swing stably in steps of `time_step` [s]; spacing d [m]."""
    from oilsim.neighborhood.smoothing_kernels import lattice_stiffness

    return (STABLE * 2.0 * spacing / time_step) ** 2 / lattice_stiffness(dimension)


class SolverSettings(Protocol):
    """Settings of a fluid that must agree, in a `FluidConfig` or in an object of another package."""

    @property
    def particle_spacing(self) -> float:
        """Particle spacing [m]."""

    @property
    def minimum_time_step(self) -> float:
        """Shortest time step [s]."""

    @property
    def maximum_time_step(self) -> float | None:
        """Longest time step [s]; None: `longest_time_step` chooses it."""

    @property
    def sleep_speed(self) -> float:
        """Speed [m/s] below which regions fall asleep; 0: none does."""

    @property
    def scheme(self) -> str:
        """Name of the scheme."""

    @property
    def gravity(self) -> Vector:
        """Acceleration of free fall (3,) [m/s2]."""


def longest_time_step(settings: SolverSettings) -> float:
    """Return the longest time step [s]: the one that is set, or else 1 / STEPS_A_PERIOD of the period of the shortest resolved wave.

    A deep-water wave of length L has the period sqrt(2 pi L / g) (Airy); here L is SHORTEST_WAVE spacings. Without gravity, where no wave
    runs, the Earth's counts.
    """
    if settings.maximum_time_step is not None:
        return settings.maximum_time_step
    gravity = math.hypot(*settings.gravity) or GRAVITY
    period = math.sqrt(2.0 * math.pi * SHORTEST_WAVE * max(0.0, settings.particle_spacing) / gravity)
    return max(settings.minimum_time_step, period / STEPS_A_PERIOD)


def contradictions(settings: SolverSettings) -> Iterator[tuple[str, str]]:
    """Say which settings do not go together, each by its name and what is wrong with it."""
    if settings.sleep_speed > 0.0 and (settings.scheme == "paper" or not any(settings.gravity)):
        yield "sleep_speed", f"is {settings.sleep_speed:g} m/s, allowed: 0 in the paper's scheme and without gravity"
    if settings.gravity[2] > 0.0:
        yield "gravity", f"is {list(settings.gravity)}, allowed: 0 or less along z, which points up"
    longest = longest_time_step(settings)
    if settings.minimum_time_step > longest:
        yield (
            "minimum_time_step",
            f"is {settings.minimum_time_step:g} s, allowed: up to maximum_time_step = {longest:g} s",
        )


@dataclass(frozen=True, kw_only=True)
class FluidConfig:
    """Constant data of a fluid. Lengths [m], times [s]; world frame z up. ValueError names all values that are not allowed.

    particle_spacing       edge d of a particle's rest volume d^dimension (the paper's diameter)
    lower, upper           the domain; a particle that leaves it is removed and counted: behind walls it has to go on for half a spacing
                           at least, since particles that are pressed onto a wall may stand a little inside it
    periodic               axes on which the domain repeats
    dimension              3, or 2 for a plane case in x and z (every y is 0)
    scheme                 "split" (default: positions and velocities constrained apart) or "paper" (Qiu et al. 2021, Alg. 3)
    density_tolerance      mean compression (rho / rho_0 - 1)+ that ends the density iterations
    divergence_tolerance   mean compression a step, dt (D rho / Dt) / rho, that ends the divergence iterations: of all particles, of each
                           liquid but the one that there is most of, with the particles that touch it, and of those beside bodies; a
                           tenth of it in a filled box
    viscosity_tolerance    relative residual that ends the viscosity solve
    relaxation             omega of Eq. 23
    viscosity_correction   gamma of Eq. 29; 1 is physical, the paper used 1e4
    explicit_viscosity     Eq. 25 forward in time instead of Eq. 26, which is stable for thin liquids only
    maximum_time_step      [s]; None (default): `longest_time_step` takes it from the spacing, 10 ms at 5 cm, 20 ms at 20 cm
    cfl                    lambda of Eq. 30
    sleep_speed            speed [m/s] below which whole regions fall asleep (`sleeping_regions`); 0: none ever does
    well_balanced          part of the pressure of water at rest acts by its own slope (`rest_pressure`): deep water takes long steps
    sleep_margin           [supports] of still water at least that stay awake between sleeping and moving water, and width of a region
    """

    particle_spacing: float = quantity("m", above=0.0)
    phases: tuple[Phase, ...]
    lower: Vector = quantity("m")
    upper: Vector = quantity("m")
    periodic: tuple[bool, bool, bool] = (False, False, False)
    gravity: Vector = quantity("m/s2", default=(0.0, 0.0, -GRAVITY), at_least=-HARDEST_PULL, at_most=HARDEST_PULL)
    dimension: int = quantity("", default=3, at_least=2, at_most=3, whole=True)
    scheme: Scheme = "split"
    density_tolerance: float = quantity("", default=1e-3, above=0.0, below=0.1)
    divergence_tolerance: float = quantity("", default=1e-4, above=0.0, below=0.1)
    viscosity_tolerance: float = quantity("", default=1e-4, above=0.0, below=0.1)
    density_iterations: int = quantity("", default=50, at_least=1, at_most=MOST_ITERATIONS, whole=True)
    divergence_iterations: int = quantity("", default=100, at_least=1, at_most=MOST_ITERATIONS, whole=True)
    viscosity_iterations: int = quantity("", default=200, at_least=1, at_most=MOST_ITERATIONS, whole=True)
    relaxation: float = quantity("", default=0.1, at_least=0.0, at_most=1.0)
    viscosity_correction: float = quantity("", default=1.0, above=0.0)
    explicit_viscosity: bool = False
    well_balanced: bool = False
    minimum_time_step: float = quantity("s", default=1e-4, at_least=SHORTEST_STEP)
    maximum_time_step: float | None = quantity("s", default=None, at_least=SHORTEST_STEP)
    cfl: float = quantity("", default=0.4, at_least=1e-3, at_most=1.0)
    sleep_speed: float = quantity("m/s", default=0.0, at_least=0.0)
    sleep_margin: float = quantity("supports", default=2.0, at_least=1.0, at_most=10.0)

    def __post_init__(self) -> None:
        problems = list(self._of_another_kind()) or [*self._out_of_range(), *self._at_odds()]
        if problems:
            raise ValueError("fluid: " + "; ".join(problems))
        for key in VECTORS:  # kernels take tuples of one kind of numbers only
            object.__setattr__(self, key, tuple(float(number) for number in getattr(self, key)))
        object.__setattr__(self, "periodic", tuple(bool(repeats) for repeats in self.periodic))

    def _of_another_kind(self) -> Iterator[str]:
        """Say which values have another type than declared; their limits cannot be checked."""
        for key, declared in quantities(FluidConfig).items():
            value = getattr(self, key)
            if value is None and key in MAY_BE_NONE:
                continue
            if key not in VECTORS:
                misfit = declared.misfit(value)
                if misfit:
                    yield f"{key} {misfit}"
            elif not _are_three(value, lambda number: is_number(number) and math.isfinite(number)):
                yield f"{key} is {value}, allowed: three finite numbers"
        if not _are_three(self.periodic, lambda repeats: repeats in (True, False)):
            yield f"periodic is {self.periodic!r}, allowed: True or False for each of x, y and z"
        for key in ("explicit_viscosity", "well_balanced"):
            if getattr(self, key) not in (True, False):
                yield f"{key} is {getattr(self, key)!r}, allowed: True or False"
        if not (isinstance(self.phases, (tuple, list)) and all(isinstance(phase, Phase) for phase in self.phases)):
            yield f"phases is {self.phases!r}, allowed: a tuple of Phase"

    def _out_of_range(self) -> Iterator[str]:
        """Say which values lie outside their own limits."""
        for key, declared in quantities(FluidConfig).items():
            value = getattr(self, key)
            if value is None:
                continue
            fault = declared.fault(tuple(value) if key in VECTORS else value)
            if fault:
                yield f"{key} {fault}"
        if self.scheme not in ("split", "paper"):
            yield f"scheme is {self.scheme!r}, allowed: 'split', 'paper'"
        if not 1 <= len(self.phases) <= 255:
            yield f"phases holds {len(self.phases)} phases, allowed: 1 to 255"
        if len({phase.name for phase in self.phases}) < len(self.phases):
            yield "phases share a name, allowed: one name each"
        for axis, low, high in zip("xyz", self.lower, self.upper, strict=True):
            if not high > low:
                yield f"upper.{axis} is {high} m, allowed: above lower.{axis} = {low} m"

    def _at_odds(self) -> Iterator[str]:
        """Say what does not go together."""
        yield from (f"{key} {text}" for key, text in contradictions(self))
        if self.dimension == 2 and self.gravity[1] != 0.0:
            yield f"gravity.y is {self.gravity[1]} m/s2, allowed: 0 in two dimensions"
        axes = (0, 2) if self.dimension == 2 else (0, 1, 2)  # a plane's particles have no y
        if self.well_balanced and (
            self.scheme == "paper" or self.gravity[:2] != (0.0, 0.0) or not self.gravity[2] < 0.0
        ):
            yield "well_balanced is True, allowed: False in the paper's scheme and under a gravity that is not straight down"
        furthest = max(abs(corner[axis]) for corner in (self.lower, self.upper) for axis in axes)
        if not furthest <= FURTHEST * self.particle_spacing:
            yield (
                f"lower and upper reach {furthest} m from the origin, allowed: {FURTHEST} particle spacings; "
                "beyond that 32 bits tell places of particles apart too coarsely"
            )
        yield from self._at_odds_with_tension()
        thickest = max((phase.dynamic_viscosity / phase.rest_density for phase in self.phases), default=0.0)
        spread, square = self.viscosity_correction * thickest * self.longest_time_step, self.particle_spacing**2
        if self.explicit_viscosity and spread > EXPLICIT_UP_TO * square > 0.0:
            yield (
                f"explicit_viscosity is True with a viscous number nu maximum_time_step / particle_spacing^2 of {spread / square:.3g}, "
                f"allowed: up to {EXPLICIT_UP_TO}, beyond which it swings ever wider"
            )

    def _at_odds_with_tension(self) -> Iterator[str]:
        """Say what does not go together with interfacial tension."""
        if self.particle_spacing <= 0.0 or self.capillary_time == math.inf:
            return
        if self.scheme == "paper":
            yield "scheme is 'paper' with an interfacial_tension, allowed: 'split'"
        if self.sleep_speed > 0.0:
            yield f"sleep_speed is {self.sleep_speed:g} m/s with an interfacial_tension, allowed: 0"
        if self.minimum_time_step > self.capillary_time_step:
            yield (
                f"minimum_time_step is {self.minimum_time_step:g} s, allowed: up to {self.capillary_time_step:.3g} s with this "
                "interfacial_tension and particle_spacing"
            )

    @property
    def longest_time_step(self) -> float:
        """Longest time step [s]."""
        return longest_time_step(self)

    @property
    def rest_volume(self) -> float:
        """Volume of one particle at rest, d^dimension [m3; m2 in two dimensions]."""
        return self.particle_spacing**self.dimension

    @property
    def support_radius(self) -> float:
        """Distance beyond which particles do not see each other [m]."""
        from oilsim.neighborhood.smoothing_kernels import SUPPORT  # here: a fluid is described without compiled code

        return SUPPORT * self.particle_spacing

    @property
    def capillary_time(self) -> float:
        """Time [s] in which the shortest ripples move, sqrt((rho_1 + rho_2) d^3 / sigma); infinite without interfacial tension."""
        return math.sqrt(capillary_inertia(self.phases) * self.particle_spacing**3)

    @property
    def capillary_time_step(self) -> float:
        """Longest time step [s] that tensions allow.

        It is sqrt((rho_1 + rho_2) d^3 / (4 pi sigma)) (Brackbill et al. 1992), and less where one liquid is far lighter: its particles must
        swing stably under the pressure that keeps interfaces whole.
        """
        ripples = self.capillary_time / math.sqrt(4.0 * math.pi)
        lightest = min((phase.rest_density for phase in self.phases), default=math.inf)
        head = least_pressure(self.phases, self.particle_spacing) / lightest
        return min(ripples, swing_time_step(self.particle_spacing, self.dimension, head))

    def phase_index(self, name: str) -> int:
        """Return the index of the phase called `name`; ValueError names the phases there are."""
        names = [phase.name for phase in self.phases]
        if name not in names:
            raise ValueError(f"phase {name!r} does not exist, allowed: {', '.join(names)}")
        return names.index(name)
