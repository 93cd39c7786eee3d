"""Units of connections against the definitions of the International System."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coupling.master.units import Unit, conversion, read_unit


@pytest.mark.parametrize(
    ("text", "same_as"),
    [
        ("N m", "kg.m2/s2"),
        ("1/(kg m2)", "kg^-1 m-2"),
        ("Pa", "N/m2"),
        ("W", "J/s"),
        ("", "1"),
        ("kg m/s2", "kg*m*s-2"),
        ("kg·m²·s⁻²", "N m"),
        ("m/s**2", "m s-2"),
        ("kNm", "kJ"),
    ],
)
def test_spellings_of_one_unit(text: str, same_as: str) -> None:
    assert read_unit(text) == read_unit(same_as) is not None


@pytest.mark.parametrize("text", ["furlong", "N, N m", "m/", "(m", "m)", "m//s", "2 m", "1000 N", "10", "m**", "m⁻"])
def test_what_the_table_does_not_know_is_not_guessed(text: str) -> None:
    assert read_unit(text) is None


@pytest.mark.parametrize(
    ("source", "target", "value", "expected"),
    [
        ("kn", "m/s", 1.0, 1852.0 / 3600.0),
        ("km/h", "kn", 1.852, 1.0),
        ("deg", "rad", 180.0, math.pi),
        ("rpm", "rad/s", 60.0, 2.0 * math.pi),
        ("degC", "K", 10.0, 283.15),
        ("K", "°C", 273.15, 0.0),
        ("kN", "N", 2.5, 2500.0),
        ("t/h", "kg/s", 3.6, 1.0),
    ],
)
def test_conversions(source: str, target: str, value: float, expected: float) -> None:
    units = read_unit(source), read_unit(target)
    assert units[0] is not None and units[1] is not None
    found = conversion(units[0], units[1])
    assert found is not None
    assert found.factor * value + found.offset == pytest.approx(expected, rel=1e-14, abs=1e-12)


def test_other_dimensions_do_not_convert() -> None:
    metre, second, angle = read_unit("m"), read_unit("s"), read_unit("rad/s")
    assert metre is not None and second is not None and angle is not None
    assert conversion(metre, second) is None
    assert conversion(angle, Unit(read_unit("Hz").exponents)) is None  # type: ignore[union-attr]
    assert conversion(metre, metre) is not None and conversion(metre, metre).is_identity  # type: ignore[union-attr]
    assert np.isclose(metre.factor, 1.0)
