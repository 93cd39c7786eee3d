"""Units of connected variables, and conversions between them.

As in FMI, a unit is defined by its relation to the SI base units: a quantity q is, in SI,

    q_SI = factor * q + offset,     of the dimension kg^a m^b s^c A^d K^e mol^f cd^g rad^h.

FMUs give these numbers in their model description. Other participants name their units in text, which is read with a small table:
"N m", "kg.m2/s", "1/(kg m2)", "m³", "m/s**2", "kn", "deg". A library of units would know more units, but not FMI's offsets and exponents.
Quantities of mixed units name each group ("N, N m"); they are passed on without conversion.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cache

from oilsim.core.physical_constants import DEGREE, KNOT, NAUTICAL_MILE

BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
Exponents = tuple[int, int, int, int, int, int, int, int]
NONE: Exponents = (0, 0, 0, 0, 0, 0, 0, 0)


@dataclass(frozen=True)
class Unit:
    """A unit by its relation to SI: q_SI = factor * q + offset; exponents in the order of `BASE`."""

    exponents: Exponents = NONE
    factor: float = 1.0
    offset: float = 0.0

    def __mul__(self, other: Unit) -> Unit:
        total = tuple(a + b for a, b in zip(self.exponents, other.exponents, strict=True))
        return Unit(total, self.factor * other.factor)  # type: ignore[arg-type]

    def __pow__(self, power: int) -> Unit:
        return Unit(tuple(power * a for a in self.exponents), self.factor**power)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Conversion:
    """A conversion of values: target = factor * source + offset."""

    factor: float = 1.0
    offset: float = 0.0

    @property
    def is_identity(self) -> bool:
        """True if the conversion changes no value."""
        return self.factor == 1.0 and self.offset == 0.0


def _base(**powers: int) -> Exponents:
    return tuple(powers.get(name, 0) for name in BASE)  # type: ignore[return-value]


_FORCE, _PRESSURE = _base(kg=1, m=1, s=-2), _base(kg=1, m=-1, s=-2)
_ENERGY, _POWER = _base(kg=1, m=2, s=-2), _base(kg=1, m=2, s=-3)
_LENGTH, _MASS, _TIME, _SPEED, _ANGLE = _base(m=1), _base(kg=1), _base(s=1), _base(m=1, s=-1), _base(rad=1)

SYMBOLS = {
    "1": Unit(),
    "%": Unit(factor=0.01),
    "m": Unit(_LENGTH), "mm": Unit(_LENGTH, 1e-3), "cm": Unit(_LENGTH, 1e-2), "km": Unit(_LENGTH, 1e3),
    "ft": Unit(_LENGTH, 0.3048), "nmi": Unit(_LENGTH, NAUTICAL_MILE),
    "l": Unit(_base(m=3), 1e-3), "L": Unit(_base(m=3), 1e-3),
    "s": Unit(_TIME), "ms": Unit(_TIME, 1e-3), "min": Unit(_TIME, 60.0), "h": Unit(_TIME, 3600.0), "d": Unit(_TIME, 86400.0),
    "kg": Unit(_MASS), "g": Unit(_MASS, 1e-3), "t": Unit(_MASS, 1e3),
    "kn": Unit(_SPEED, KNOT), "kt": Unit(_SPEED, KNOT),
    "N": Unit(_FORCE), "kN": Unit(_FORCE, 1e3), "MN": Unit(_FORCE, 1e6),
    "Nm": Unit(_ENERGY), "kNm": Unit(_ENERGY, 1e3), "MNm": Unit(_ENERGY, 1e6),
    "Pa": Unit(_PRESSURE), "kPa": Unit(_PRESSURE, 1e3), "MPa": Unit(_PRESSURE, 1e6), "bar": Unit(_PRESSURE, 1e5),
    "J": Unit(_ENERGY), "kJ": Unit(_ENERGY, 1e3), "W": Unit(_POWER), "kW": Unit(_POWER, 1e3), "MW": Unit(_POWER, 1e6),
    "Hz": Unit(_base(s=-1)), "A": Unit(_base(A=1)), "mol": Unit(_base(mol=1)), "cd": Unit(_base(cd=1)),
    "rad": Unit(_ANGLE), "deg": Unit(_ANGLE, DEGREE), "°": Unit(_ANGLE, DEGREE),
    "rpm": Unit(_base(rad=1, s=-1), math.pi / 30.0),
    "K": Unit(_base(K=1)), "degC": Unit(_base(K=1), 1.0, 273.15), "°C": Unit(_base(K=1), 1.0, 273.15),
}  # fmt: skip
_PLAIN = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻−", "0123456789--")
_TOKEN = re.compile(r"\s*(?:(?P<symbol>[^\W\d_]+|[%°]C?|1(?!\d))(?:\^?(?P<power>-?\d+))?|(?P<sign>[/()*.·]))")


@cache
def read_unit(text: str) -> Unit | None:
    """Read the unit that a text names; return None if the table does not know it, or if the text names mixed units."""
    tokens, at, text = [], 0, text.translate(_PLAIN).replace("**", "^")
    while at < len(text.rstrip()):
        match = _TOKEN.match(text, at)
        if match is None or (match["symbol"] and match["symbol"] not in SYMBOLS):
            return None
        tokens.append(match)
        at = match.end()
    if len(tokens) == 1 and tokens[0]["symbol"] and not tokens[0]["power"]:
        return SYMBOLS[tokens[0]["symbol"]]  # alone, a temperature keeps its offset
    try:
        result = _product(tokens)
    except (IndexError, KeyError):  # an open bracket, or a sign where a symbol belongs
        return None
    return result if not tokens else None


def _product(tokens: list[re.Match[str]]) -> Unit:
    """Multiply the factors up to a closing bracket or the end; a slash divides by the one factor that follows it."""
    result = Unit()
    while tokens and tokens[0]["sign"] != ")":
        token = tokens.pop(0)
        divides = token["sign"] == "/"
        if token["sign"] in ("/", "*", ".", "·"):
            token = tokens.pop(0)
        if token["sign"] == "(":
            factor = _product(tokens)
            tokens.pop(0)  # the closing bracket
        else:
            factor = SYMBOLS[token["symbol"]] ** int(token["power"] or 1)
        result = result * factor ** (-1 if divides else 1)
    return result


def conversion(source: Unit, target: Unit) -> Conversion | None:
    """Return the conversion of values from the unit `source` to the unit `target`; None if their dimensions differ.

    factor_t q_t + offset_t = factor_s q_s + offset_s
    """
    if source.exponents != target.exponents:
        return None
    return Conversion(source.factor / target.factor, (source.offset - target.offset) / target.factor)
