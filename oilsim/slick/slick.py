"""A slick of oil on a sea without particles of water: parcels, the barriers around them, and one step of time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from oilsim.backend.arrays import Array
from oilsim.core.physical_constants import SEA_WATER_DENSITY
from oilsim.core.quantity import quantity, require
from oilsim.oil.ledger import OilRows, rows_of
from oilsim.slick.barriers import Barrier, Barriers, Immersion
from oilsim.slick.crossing import beside, first_crossings, moving_sweep, resting_sweep
from oilsim.slick.gradient_flow import Liquids, cell_size, spread
from oilsim.slick.loss_rate import LossRate, Pools, no_loss
from oilsim.slick.losses import Losses, lose_through_openings
from oilsim.slick.merging import merge_parcels, oil_within, recover
from oilsim.slick.oil import Oil
from oilsim.slick.parcels import Parcels, ParcelState, Rows
from oilsim.slick.pools import (
    arrange,
    hold,
    lose_around_ends,
    measure_pools,
    release_slack,
    slacken,
    slide,
    sustain,
)
from oilsim.slick.stranding import carry_stranded, nearest_water, strand, strand_held


class SurfaceFlow(Protocol):
    """The motion of floating oil where no boom is: current, Stokes drift and drift of the wind, added up.

    The velocity is the mean over waves. Turbulence finer than the flow's own scale is not in it: `SlickSettings.diffusivity` stands for it.
    """

    def surface_velocity(self, points_xy: Array, time: float) -> Array:
        """Return the velocity (N, 2) [m/s] at points (N, 2) [m] in the world at `time` [s]; it must not write into the points."""


# [rad] angle between successive parcels of a release; theory (Vogel 1979); the golden angle fills a disc evenly
GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))


@dataclass(frozen=True, kw_only=True)
class SlickSettings:
    """Constants of a slick.

    loss_volume    [m3]    oil that leaves a boom in one parcel
    water_density  [kg/m3]
    water_viscosity  [m2/s]  kinematic
    diffusivity    [m2/s]  K of turbulence finer than the flow; each step adds a normal deviate of (2 K dt)^(1/2) in each direction
    friction       [-]     C_f of the interfacial stress ahead of booms, a closure
    most_parcels           number above which parcels merge
    seed                   of all random numbers

    Raises ValueError for a value that is not allowed.
    """

    loss_volume: float = quantity("m3", above=0.0)
    water_density: float = quantity("kg/m3", default=SEA_WATER_DENSITY, above=0.0)
    water_viscosity: float = quantity("m2/s", default=1.19e-6, above=0.0)
    diffusivity: float = quantity("m2/s", default=0.0, at_least=0.0)
    friction: float = quantity("", default=0.005, above=0.0)
    most_parcels: int = quantity("", default=20_000, at_least=1, whole=True)
    seed: int = quantity("", default=0, at_least=0, whole=True)

    def __post_init__(self) -> None:
        require("slick", SlickSettings, vars(self))


class Slick:
    """Parcels of oil in plan view, and the booms and outlines that they meet.

    Call `release` and `recover` between steps, `move` before a step for each barrier that moves in it, then `step`. `pools` is the state of
    all pools as the last step ended.
    Everything random comes from the seed, and no result depends on threads: kernels are serial.
    """

    def __init__(self, settings: SlickSettings, barriers: Sequence[Barrier] = ()) -> None:
        self.settings = settings
        self.barriers = Barriers(barriers)
        self.parcels = Parcels()
        self.losses = Losses(len(self.barriers))
        self._random = np.random.default_rng(settings.seed)
        self._released = 0.0
        self.changes = 0  # releases, recoveries, steps and restored states so far
        self._sustained = np.zeros(2 * len(self.barriers))  # [m/s] of the water against each pool's segment
        self._slack = np.ones(2 * len(self.barriers))  # [-] of each pool, see `slacken`
        self.pools = self._measure(np.zeros((len(self.barriers), 2)))

    @property
    def slack(self) -> Array:
        """Slack (P,) [-] of each pool: how far the water has run back from its segment; at 1 the boom lets the oil go (`slacken`)."""
        return self._slack

    def release(
        self, oil: Oil, volume: float, *, count: int, center: tuple[float, float], radius: float, age: float = 0.0
    ) -> None:
        """Put `volume` [m3] of oil on the water, as `count` equal parcels in a disc of `radius` [m] with the shape of a spreading slick.

        age [s]: time for which it has been spreading. Raises ValueError for numbers that cannot be, oil as dense as the water, and a
        disc with parcels inside an outline.
        """
        self._require_release(oil, volume, count, radius, age)
        columns = self._disc(oil, volume, count, center, radius, age)
        if self.barriers.encloses(columns["position"]).any():
            raise ValueError(f"release: the disc at {center} reaches into an outline, allowed: water")
        self._add(columns, volume)

    def pour(self, oil: Oil, volume: float, *, center: tuple[float, float], radius: float) -> None:
        """Put `volume` [m3] of fresh oil in a disc of `radius` [m] as one parcel; on land or a hull it runs down to the nearest water.

        Raises ValueError for numbers that cannot be, and oil as dense as the water.
        """
        self._require_release(oil, volume, 1, radius, 0.0)
        columns = self._disc(oil, volume, 1, center, radius, 0.0)
        if self.barriers.encloses(columns["position"]).any():
            columns["position"] = nearest_water(columns["position"], self.barriers)
        self._add(columns, volume)

    def _disc(
        self, oil: Oil, volume: float, count: int, center: tuple[float, float], radius: float, age: float
    ) -> dict[str, Any]:
        """Return the columns of `count` equal parcels of `volume` [m3] in all, in a disc of `radius` [m]; age [s]."""
        share = (np.arange(count) + 0.5) / count
        distance = radius * np.sqrt(1.0 - np.cbrt(1.0 - share) ** 2)
        angle = GOLDEN_ANGLE * np.arange(count) + 2.0 * math.pi * self._random.random()
        ray = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        volumes = np.full(count, volume / count)
        volumes[-1] = volume - volumes[:-1].sum()
        thickness = 1.5 * volume / (math.pi * radius**2) * np.sqrt(1.0 - (distance / radius) ** 2)
        return {
            "position": np.asarray(center, np.float64) + distance[:, None] * ray, "volume": volumes, "thickness": thickness,
            "density": oil.density, "viscosity": oil.dynamic_viscosity, "interfacial_tension": oil.interfacial_tension,
            "spreading_tension": oil.spreading_tension, "oil": oil.number, "age": age, "state": ParcelState.AFLOAT,
        }  # fmt: skip

    def _add(self, columns: Mapping[str, Any], volume: float) -> None:
        self.parcels.append(columns, len(columns["volume"]))
        self._released += volume
        self.changes += 1

    def _require_release(self, oil: Oil, volume: float, count: int, radius: float, age: float) -> None:
        for name, value in (("volume", volume), ("radius", radius)):
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"release: {name} is {value}, allowed: above 0")
        if count < 1:
            raise ValueError(f"release: count is {count}, allowed: 1 or more")
        if not (math.isfinite(age) and age >= 0.0):
            raise ValueError(f"release: age is {age} s, allowed: 0 or more")
        if oil.density >= self.settings.water_density:
            raise ValueError(
                f"release: the oil's density is {oil.density:g} kg/m3, allowed: below {self.settings.water_density:g} kg/m3"
            )

    def move(self, name: str, nodes: ArrayLike, immersion: Immersion | None = None) -> None:
        """Say where a barrier's nodes (N, 2) [m] are at the end of the next step, and how a boom sits in the water.

        Raises ValueError for an unknown name and for values that cannot be.
        """
        self.barriers.move(name, nodes, immersion)

    def part(self, name: str, joint: int) -> None:
        """Let a joint of a boom part, counted from 1 at its first node: from the next step on, oil passes between its two sides.

        `move` takes two nodes there from now on. Raises ValueError for an unknown name, and for a joint that the boom does not have.
        """
        self.barriers.part(name, joint)

    def step(
        self,
        flow: SurfaceFlow,
        time: float,
        duration: float,
        loss_rate: LossRate = no_loss,
        *,
        water: SurfaceFlow | None = None,
    ) -> None:
        """Go from `time` to `time + duration` [s].

        flow: motion of floating oil; water: that of the water at the booms' depth, the same if None. Raises ValueError for a duration
        that is not above 0, and for loss rates or a flow that cannot be.
        """
        if not (math.isfinite(duration) and duration > 0.0):
            raise ValueError(f"slick: duration is {duration} s, allowed: above 0")
        self.changes += 1
        relative = self.relative_velocity(water or flow, time, duration)
        sustain(self._sustained, self.barriers, relative, duration)
        slacken(self._slack, self.barriers, relative, duration)
        self._drift(flow, time, duration, relative)
        self._tend_pools(relative, duration, loss_rate)
        carry_stranded(self.parcels, self.barriers)
        self.parcels.age += duration
        self.barriers.settle()
        if len(self.parcels) > self.settings.most_parcels:
            there = self.parcels.there()  # recovered oil is one large parcel, and would widen the cells
            cell = cell_size(self.parcels.volume[there], self.parcels.thickness[there])
            merge_parcels(self.parcels, self.barriers, self.settings.most_parcels, cell)

    def relative_velocity(self, water: SurfaceFlow, time: float, duration: float) -> Array:
        """Return the velocity (S, 2) [m/s] of the water relative to each segment over the step, halfway in time and along the segment.

        In a pocket it is the slowed water's.
        """
        barriers = self.barriers
        old, new = barriers.old_start + barriers.old_end, barriers.start + barriers.end
        flow = _velocity(water, 0.25 * (old + new), time + 0.5 * duration)
        return barriers.flow_share[:, None] * (flow - 0.5 * (new - old) / duration)

    def _drift(self, flow: SurfaceFlow, time: float, duration: float, relative: Array) -> None:
        """Spread, carry and disperse all drifting parcels; barriers stop them."""
        parcels, settings = self.parcels, self.settings
        rows = np.flatnonzero((parcels.state == ParcelState.AFLOAT) | (parcels.state == ParcelState.LOST))
        if not len(rows):
            return
        liquids = Liquids(settings.water_density, settings.water_viscosity)
        resolved = np.flatnonzero(
            parcels.state == ParcelState.RESOLVED
        )  # they make the slick thicker, and move as particles do
        target = spread(parcels, np.append(rows, resolved), duration, liquids)[: len(rows)]
        first = _velocity(flow, target, time)
        target += duration * _velocity(flow, target + 0.5 * duration * first, time + 0.5 * duration)
        if settings.diffusivity > 0.0:
            target += math.sqrt(2.0 * settings.diffusivity * duration) * self._random.standard_normal(
                (len(rows), 2), np.float32
            )
        met = first_crossings(parcels.position_of(rows), target, moving_sweep(self.barriers))
        free = met.segment < 0
        lose_through_openings(parcels, self.barriers, self.losses, rows[free], target[free])
        parcels.put_position(rows, target)
        hit = np.flatnonzero(met.segment >= 0)
        if len(hit):
            self._stop(rows[hit], met.segment[hit], met.along[hit], met.side[hit], relative)

    def _stop(self, rows: Rows, segment: Rows, along: Array, side: Rows, relative: Array) -> None:
        """Stop parcels at the segments that they met: pools take them, outlines too as far as there is room, others lie beside."""
        parcels, barriers = self.parcels, self.barriers
        parcels.position[rows] = beside(barriers, segment, along, side, resting_sweep(barriers))
        boom = barriers.is_boom[segment]
        pressed = boom & (side * np.einsum("mk,mk->m", relative[segment], barriers.normals()[segment]) < 0.0)
        self.losses.recontain(parcels, barriers, rows[pressed], segment[pressed])
        hold(parcels, rows[pressed], segment[pressed], along[pressed], side[pressed])
        strand(parcels, barriers, rows[~boom], segment[~boom], along[~boom], side[~boom])

    def _tend_pools(self, relative: Array, duration: float, loss_rate: LossRate) -> None:
        """Slide, arrange and lose the oil that booms hold."""
        parcels, barriers, friction = self.parcels, self.barriers, self.settings.friction
        if not len(parcels.in_pools()):
            self.losses.owed[:] = 0.0
            self.pools = self._measure(relative)
            return
        gone = slide(parcels, barriers, self.pools, relative, duration, friction)
        gone = np.setdiff1d(gone, strand_held(parcels, barriers))
        if len(gone):
            self.losses.gone += lose_around_ends(parcels, barriers, gone)
        self.pools = self._measure(relative)
        arrange(parcels, barriers, self.pools, duration, friction)
        self.losses.add(loss_rate(self.pools), self.pools, barriers, duration)
        changed = release_slack(parcels, self._slack)
        if self.losses.carry_out(parcels, barriers, self.pools.volume, self.settings.loss_volume) or changed:
            self.pools = self._measure(relative)

    def _measure(self, relative: Array) -> Pools:
        settings = self.settings
        return measure_pools(
            self.parcels, self.barriers, relative, self._sustained, settings.water_density, settings.friction
        )

    def oil_within(self, center: tuple[float, float], radius: float) -> tuple[float, float]:
        """Return the volume [m3] of the oil on the water within `radius` [m] of a center, and its mean density [kg/m3], 0 without oil."""
        return oil_within(self.parcels, center, radius)

    def recover(self, center: tuple[float, float], radius: float, volume: float) -> float:
        """Take up to `volume` [m3] off the water within `radius` [m] of a center; return the volume that was there [m3].

        Raises ValueError for a radius or volume below 0.
        """
        self.changes += 1
        return recover(self.parcels, center, radius, volume)

    @property
    def oil(self) -> OilRows:
        """All oil by its fate; what no particle carried past a boom is modelled."""
        parcels = self.parcels
        return rows_of(
            self._released, parcels.volume, parcels.fate_codes(), ~parcels.carried,
            resolved=float(parcels.volume[parcels.state == ParcelState.RESOLVED].sum()),
        )  # fmt: skip

    def save_state(self) -> dict[str, Any]:
        """Return everything that the next steps depend on."""
        return {
            "parcels": self.parcels.save_state(),
            "barriers": self.barriers.save_state(),
            "losses": self.losses.save_state(),
            "pools": self.pools,
            "sustained": self._sustained.copy(),
            "slack": self._slack.copy(),
            "random": self._random.bit_generator.state,
            "released": self._released,
        }

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to what `save_state` returned; the steps that follow are equal bit for bit."""
        self.changes += 1
        self.parcels.restore_state(saved["parcels"])
        self.barriers.restore_state(saved["barriers"])
        self.losses.restore_state(saved["losses"])
        self._sustained, self._slack = np.array(saved["sustained"]), np.array(saved["slack"])
        self.pools = Pools(*saved["pools"])  # a checkpoint's file holds a plain tuple
        self._random.bit_generator.state = saved["random"]
        self._released = saved["released"]


def _velocity(flow: SurfaceFlow, points: Array, time: float) -> Array:
    """Ask a flow for velocities (N, 2) [m/s], and check them."""
    if not len(points):
        return np.zeros((0, 2))
    given = np.asarray(flow.surface_velocity(points, time), np.float64)
    if given.shape != points.shape or not np.isfinite(given).all():
        raise ValueError(
            f"slick: surface_velocity returned an array {given.shape} at {time:g} s, allowed: finite, of shape {points.shape}"
        )
    return given
