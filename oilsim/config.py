"""What a fluid is made of and how it is solved: one frozen description, refused at construction if impossible."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from numbers import Integral, Real
from typing import Any, Literal

from oilsim.neighborhood.smoothing_kernels import SUPPORT
from oilsim.phases import EXPLICIT_UP_TO, Phase

Vector = tuple[float, float, float]
Scheme = Literal["split", "paper"]
Rule = tuple[str, Callable[[float], bool], str]

ROUNDING = 2.0**-24  # relative, of a number of 32 bits
COARSEST = 1e-3  # spacings by which rounding may move a particle
VECTORS = ("gravity", "lower", "upper")

RULES: tuple[Rule, ...] = (
    ("particle_spacing", lambda v: v > 0.0, "above 0 m"),
    ("density_tolerance", lambda v: 0.0 < v < 0.1, "above 0 and below 0.1"),
    ("divergence_tolerance", lambda v: 0.0 < v < 0.1, "above 0 and below 0.1"),
    ("viscosity_tolerance", lambda v: 0.0 < v < 0.1, "above 0 and below 0.1"),
    ("density_iterations", lambda v: v >= 1, "whole numbers from 1 on"),
    ("divergence_iterations", lambda v: v >= 1, "whole numbers from 1 on"),
    ("viscosity_iterations", lambda v: v >= 1, "whole numbers from 1 on"),
    ("relaxation", lambda v: 0.0 <= v <= 1.0, "0 to 1"),
    ("viscosity_correction", lambda v: v > 0.0, "above 0"),
    ("minimum_time_step", lambda v: v > 0.0, "above 0 s"),
    ("maximum_time_step", lambda v: v > 0.0, "above 0 s"),
    ("cfl", lambda v: 0.0 < v <= 1.0, "above 0 to 1"),
    ("sleep_speed", lambda v: v >= 0.0, "0 m/s or more"),
)


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def _are_three(values: Any, fit: Callable[[Any], bool]) -> bool:
    return isinstance(values, Iterable) and len(members := tuple(values)) == 3 and all(fit(value) for value in members)


@dataclass(frozen=True, kw_only=True)
class FluidConfig:
    """Constant data of a fluid. Lengths [m], times [s]; world frame z up.

    particle_spacing       edge d of a particle's rest volume d^dimension (the paper's diameter)
    lower, upper           the domain; a particle that leaves it is removed and counted: behind walls it has to go on for half a spacing
                           at least, since those who are pressed onto a wall may stand a little inside it
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
    cfl                    lambda of Eq. 30
    sleep_speed            speed [m/s] below which whole regions fall asleep (`sleeping_regions`); 0: none ever does
    """

    particle_spacing: float
    phases: tuple[Phase, ...]
    lower: Vector
    upper: Vector
    periodic: tuple[bool, bool, bool] = (False, False, False)
    gravity: Vector = (0.0, 0.0, -9.81)
    dimension: int = 3
    scheme: Scheme = "split"
    density_tolerance: float = 1e-3
    divergence_tolerance: float = 1e-4
    viscosity_tolerance: float = 1e-4
    density_iterations: int = 50
    divergence_iterations: int = 100
    viscosity_iterations: int = 200
    relaxation: float = 0.1
    viscosity_correction: float = 1.0
    explicit_viscosity: bool = False
    minimum_time_step: float = 1e-4
    maximum_time_step: float = 1e-2
    cfl: float = 0.4
    sleep_speed: float = 0.0

    def __post_init__(self) -> None:
        problems = list(self._of_another_kind()) or [*self._out_of_range(), *self._at_odds()]
        if problems:
            raise ValueError("fluid: " + "; ".join(problems))
        for key in VECTORS:  # kernels take tuples of one kind of numbers only
            object.__setattr__(self, key, tuple(float(number) for number in getattr(self, key)))
        object.__setattr__(self, "periodic", tuple(bool(repeats) for repeats in self.periodic))

    def _of_another_kind(self) -> Iterator[str]:
        """What cannot be compared with anything, so that nothing else can be said."""
        for key, _, allowed in RULES:
            value = getattr(self, key)
            if not _is_number(value) or (key.endswith("iterations") and not isinstance(value, Integral)):
                yield f"{key} is {value!r}, allowed: {allowed}"
        for key in VECTORS:
            value = getattr(self, key)
            if not _are_three(value, lambda number: _is_number(number) and math.isfinite(number)):
                yield f"{key} is {value}, allowed: three finite numbers"
        if not _are_three(self.periodic, lambda repeats: repeats in (True, False)):
            yield f"periodic is {self.periodic!r}, allowed: True or False for each of x, y and z"
        if self.explicit_viscosity not in (True, False):
            yield f"explicit_viscosity is {self.explicit_viscosity!r}, allowed: True or False"
        if not (isinstance(self.phases, (tuple, list)) and all(isinstance(phase, Phase) for phase in self.phases)):
            yield f"phases is {self.phases!r}, allowed: a tuple of Phase"

    def _out_of_range(self) -> Iterator[str]:
        """What is wrong whatever the rest is."""
        for key, valid, allowed in RULES:
            if not (math.isfinite(getattr(self, key)) and valid(getattr(self, key))):
                yield f"{key} is {getattr(self, key)}, allowed: {allowed}"
        if self.dimension not in (2, 3):
            yield f"dimension is {self.dimension}, allowed: 2 or 3"
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
        """What does not go together."""
        axes = (0, 2) if self.dimension == 2 else (0, 1, 2)  # a plane's particles have no y
        furthest = max(abs(corner[axis]) for corner in (self.lower, self.upper) for axis in axes)
        if not furthest * ROUNDING <= COARSEST * self.particle_spacing:
            yield (
                f"lower and upper reach {furthest} m from the origin, allowed: {COARSEST / ROUNDING:.0f} particle spacings; "
                "beyond that 32 bits tell places of particles apart too coarsely"
            )
        if self.dimension == 2 and self.gravity[1] != 0.0:
            yield f"gravity.y is {self.gravity[1]} m/s2, allowed: 0 in two dimensions"
        if self.sleep_speed > 0.0 and (self.scheme == "paper" or not any(self.gravity)):
            yield f"sleep_speed is {self.sleep_speed} m/s, allowed: 0 in the paper's scheme and without gravity"
        if self.minimum_time_step > self.maximum_time_step:
            yield f"minimum_time_step is {self.minimum_time_step} s, allowed: maximum_time_step or less"
        thickest = max((phase.dynamic_viscosity / phase.rest_density for phase in self.phases), default=0.0)
        number = self.viscosity_correction * thickest * self.maximum_time_step / self.particle_spacing**2
        if self.explicit_viscosity and number > EXPLICIT_UP_TO:
            yield (
                f"explicit_viscosity is True with a viscous number nu maximum_time_step / particle_spacing^2 of {number:.3g}, "
                f"allowed: up to {EXPLICIT_UP_TO}, beyond which it swings ever wider"
            )

    @property
    def rest_volume(self) -> float:
        """Volume of one particle at rest, d^dimension [m3; m2 in two dimensions]."""
        return self.particle_spacing**self.dimension

    @property
    def support_radius(self) -> float:
        """Distance beyond which particles do not see each other [m]."""
        return SUPPORT * self.particle_spacing

    def phase_index(self, name: str) -> int:
        """Index of the phase called `name`; ValueError names the phases there are."""
        names = [phase.name for phase in self.phases]
        if name not in names:
            raise ValueError(f"phase {name!r} does not exist, allowed: {', '.join(names)}")
        return names.index(name)
