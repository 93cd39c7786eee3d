"""A small window that meets a slick: for tests of how oil crosses it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from coupling.participants.slick import CarryingSea, SlickParticipant
from oilsim import Phase
from oilsim.sea import Sea, SeaDescription
from oilsim.slick.barriers import Boom
from oilsim.slick.oil import Oil
from oilsim.slick.parcels import ParcelState
from oilsim.slick.slick import Slick, SlickSettings
from oilsim.window.oil_exchange import OilExchange
from oilsim.window.settings import WindowSettings
from oilsim.window.water_motion import WindowFlow
from oilsim.window.window import Window
from tests.oilsim.slick.flows import UniformFlow

WATER = Phase(name="water", rest_density=1027.0, dynamic_viscosity=1e-3)
CRUDE = Phase(name="crude", rest_density=870.0, dynamic_viscosity=0.05)
OIL = Oil(density=870.0, dynamic_viscosity=0.05, interfacial_tension=0.02)
SPACING, STEP, CURRENT = 0.2, 0.1, 0.9
PARTICLE = SPACING**3


class Meeting:
    """A window that stays at a place, with a slick that drifts by."""

    def __init__(
        self,
        booms: tuple[Boom, ...] = (),
        density: float = OIL.density,
        **sea: Any,
    ) -> None:
        self.oil = replace(OIL, density=density)
        crude = replace(CRUDE, rest_density=density)
        settings = WindowSettings(size=(4.8, 4.8), depth=0.8, spacing=SPACING, rim=0.8, sleep_speed=0.02)
        self.window = Window(settings, Sea(SeaDescription(depth=10.0, **sea)), (WATER, crude), threads=1)
        self.slick = Slick(SlickSettings(loss_volume=0.02, water_density=1027.0), booms)
        flow = self.window.motion.sea.description.surface_current
        self.flow = UniformFlow((0.0, 0.0) if flow is None else (CURRENT, 0.0))
        self.participant = SlickParticipant("slick", self.slick, CarryingSea(self.flow))
        self.exchange = OilExchange(self.window)
        self.participant.meet(self.exchange, WindowFlow(self.flow, self.exchange.surface))
        self.time = 0.0

    def step(self, target: ArrayLike = (0.0, 0.0)) -> None:
        self.window.follow(np.array(target), self.time)
        self.window.fluid.time = self.time
        self.window.fluid.advance(STEP)
        self.participant.do_step(self.time, STEP)
        self.time += STEP

    @property
    def oil_particles(self) -> int:
        return len(self.window.fluid.phase_ids("crude"))

    def in_state(self, state: ParcelState) -> int:
        return int((self.slick.parcels.state == state).sum())

    def require_exact(self) -> None:
        oil = self.slick.oil
        assert abs(oil.residual) < 1e-12
        assert self.oil_particles == self.in_state(ParcelState.RESOLVED)
        assert oil.resolved == pytest.approx(self.oil_particles * PARTICLE, rel=1e-9)
        assert self.exchange.taken - self.exchange.given == pytest.approx(oil.resolved, abs=1e-9)
        assert self.window.fluid.particle_count == 24 * 24 * 4
