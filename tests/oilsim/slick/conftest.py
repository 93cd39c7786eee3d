"""Oils and small slicks for the slick's tests."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from oilsim.slick.oil import Oil
from oilsim.slick.slick import Slick, SlickSettings

LIGHT = Oil(density=875.0, dynamic_viscosity=0.02, interfacial_tension=0.02)


@pytest.fixture
def make_slick() -> Callable[..., Slick]:
    """Build a slick with a release of `volume` [m3] in `count` parcels; further keywords are settings."""

    def make(
        barriers: Any = (), *, volume: float = 2.0, count: int = 500, center: Any = (0.0, 0.0), radius: float = 10.0,
        age: float = 300.0, oil: Oil = LIGHT, **settings: Any,
    ) -> Slick:  # fmt: skip
        slick = Slick(SlickSettings(**({"loss_volume": 0.002} | settings)), barriers)
        slick.release(oil, volume, count=count, center=center, radius=radius, age=age)
        return slick

    return make
