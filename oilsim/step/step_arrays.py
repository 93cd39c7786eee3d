"""What one time step computes from the state: neighbours, densities, gradients, contacts; and the stages both schemes share."""

from __future__ import annotations

import math
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oilsim.accounts.budget import Budget
from oilsim.backend.thread_team import Team
from oilsim.boundaries.adhesion import adhesion_acceleration, adhesion_reaction, adhesion_scale
from oilsim.boundaries.boundary_particles import wall_coverage
from oilsim.boundaries.contact_film import film_wrenches
from oilsim.boundaries.wall_contact import (
    DISTANCES,
    NEAREST,
    PLACES,
    drop_share,
    wall_approach,
    wall_contact,
    wall_push,
)
from oilsim.boundaries.walls import Contacts, Walls
from oilsim.config import FluidConfig
from oilsim.density.density_feedback import surface_shares
from oilsim.density.particle_shifting import shift_balance
from oilsim.gradients.gradient_correction import largest_stretch
from oilsim.gradients.relaxation_time import LONGEST, froude_unit
from oilsim.gradients.shear_correction import STRETCH, mend_moments
from oilsim.neighborhood.neighbor_search import NeighborSearch, Pairs, fill_rows, indices, make_grid, mark_around
from oilsim.neighborhood.smoothing_kernels import lattice_moment, normalisation, steepest_slope
from oilsim.pressure.coarse_grid import CoarsePressure
from oilsim.pressure.pressure_gradient import PairVectors, cache_gradients
from oilsim.pressure.rigid_response import RigidResponse, extend_contacts
from oilsim.pressure.wall_extrapolation import PRESSED, hold_waterline
from oilsim.state import FluidState
from oilsim.step.sleeping_regions import SleepingRegions
from oilsim.step.time_step import most, relative_speeds, sampling_stride
from oilsim.step.verlet_lists import KeptLists
from oilsim.viscosity.deferred_viscosity import NEGLIGIBLE, viscosity_due
from oilsim.viscosity.viscous_response import ViscousResponse
from oilsim.viscosity.viscous_system import (
    ViscousSystem,
    implicit_share,
    is_mild,
    viscosity_matrix,
    wall_factor,
)

Real = NDArray[np.float32]


class Workspace:
    """Constants in kernel precision and the arrays of the present step; `search` must precede the other stages."""

    def __init__(self, config: FluidConfig, team: Team) -> None:
        self.config, self.team = config, team
        periods = [
            high - low if repeats else 0.0
            for low, high, repeats in zip(config.lower, config.upper, config.periodic, strict=True)
        ]
        period = (periods[0], periods[1], periods[2]) if any(config.periodic) else None
        self.period = None if period is None else tuple(np.float32(p) for p in period)
        self.support = np.float32(config.support_radius)
        self.sigma = np.float32(normalisation(config.particle_spacing, config.dimension))
        self.volume = np.float32(config.rest_volume)
        self.plane = config.dimension == 2
        self.moment = np.float32(lattice_moment(config.dimension))
        self._gravity = tuple(np.float32(g) for g in config.gravity)
        self.balance = np.float32(shift_balance(config.dimension))
        self.split = config.scheme == "split"
        shares, per_slope = surface_shares(config.dimension)
        self.surface_shares = shares, np.float32(per_slope * config.particle_spacing)
        self._wall_weight = np.float32(2.0 if self.split else 1.0)
        self.weightless = not any(config.gravity)  # then every step finds the unit anew
        self.coarse = CoarsePressure(config, team)
        self.time_unit = LONGEST if self.weightless else froude_unit(config.particle_spacing, config.gravity)
        grid = make_grid(config.lower, config.upper, config.periodic, config.support_radius, config.dimension)
        search = NeighborSearch(grid, team, period)
        self.lists = KeptLists(search, team, config.particle_spacing, config.dimension)
        self.walls = Walls(search, config.lower, period)
        self.regions = SleepingRegions(config, team) if config.sleep_speed > 0.0 else None
        self.densities = np.array([phase.rest_density for phase in config.phases])
        self.viscosities = [config.viscosity_correction * phase.dynamic_viscosity for phase in config.phases]
        self.reference_density = float(self.densities[0])
        self._weights = (self.reference_density / self.densities).astype(np.float32)
        self._viscosity = viscosity_matrix(self.viscosities, same_phase_only=config.scheme == "paper")
        scale = adhesion_scale(config.dimension) / config.particle_spacing**config.dimension
        strength = [phase.adhesion * scale / phase.rest_density for phase in config.phases]
        self._adhesion = np.array(strength, np.float32) if any(strength) else None
        self.touching_wall = np.float32(wall_coverage(0.0, config.dimension))
        self._nearest = np.float32(wall_coverage(float(NEAREST), config.dimension))
        self._coverages = np.array(
            [wall_coverage(float(h), config.dimension) for h in np.linspace(*DISTANCES, PLACES)], np.float32
        )
        self._drop = drop_share(float(self.sigma) * config.rest_volume)
        self.seconds: defaultdict[str, float] = defaultdict(float)
        self.budget: Budget | None = None  # who keeps accounts of the stages; nobody unless asked for
        longest = config.rest_volume * steepest_slope(config.particle_spacing, config.dimension)
        longest *= largest_stretch(lattice_moment(config.dimension)) + STRETCH
        self.gradient = PairVectors(np.empty((3, 0), np.int16), np.float32(longest / np.iinfo(np.int16).max))
        self.wall_gradient: Real = np.empty((3, 0), np.float32)
        self.field: Real = np.empty((0, 16), np.float32)
        self.closed = True  # no particle within reach of a free surface
        self.compression: Real = np.empty(0, np.float32)
        self.near: NDArray[np.uint8] = np.ones(0, np.uint8)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Add the wall time of a block to the named stage, and its changes to the budget if one is kept."""
        if self.budget is not None:
            self.budget.enter(name)
        begin = time.perf_counter()
        yield
        self.seconds[name] += time.perf_counter() - begin
        if self.budget is not None:
            self.budget.leave(name)

    def sleep(self, state: FluidState, time_step: float, driven: bool) -> None:
        """Let regions at rest fall asleep and others wake (see `sleeping_regions`); driven: not by gravity alone."""
        if self.regions is None:
            return
        with self.stage("sleep"):
            parting = self.regions.update(state, self.walls, time_step / self.time_unit, driven)
        if parting is not None:
            with self.stage("search"):  # whose accounts follow the particles' order
                state.take(parting.order, self.team)
                state.asleep, state.bordering = parting.asleep, parting.bordering
                self.lists.forget()

    def search(self, state: FluidState) -> None:
        """List all neighbours at the present positions, for which the state may be sorted by cell."""
        with self.stage("search"):
            self.fluid_pairs, self.wall_pairs = self.lists.update(state, self.walls)
            walls = self.walls
            count = state.listed
            self.weight = self._weights.take(state.phase)
            self.points = np.empty((count, 4), np.float32)
            self.place_points(state)
            self.rest_density = self.densities.astype(np.float32).take(state.phase)
            self.coverage, self.compression, self.diagonal, self.openness = np.empty((4, count), np.float32)
            self.own, self.gradient_sum, self.wall_slope = np.empty((3, 3, count), np.float32)
            self.matrix: Real = np.zeros((count, 8), np.float32)
            self.mended = np.empty_like(self.matrix) if self.split else None
            self.near = np.ones(count, np.uint8)
            walled = self.split and walls.count > 0
            self.extrapolation = np.empty((count, 9), np.float32) if walled else None
            self.waterline = np.empty((3, count), np.float32) if walled else None
            self.lever = np.empty((count, 9), np.float32) if self.split and walls.moving else None
            self.gradient = self.gradient._replace(whole=_reserved(self.gradient.whole, self.fluid_pairs))
            self.wall_gradient = _reserved(self.wall_gradient, self.wall_pairs)
            self.touching = walls.touching(self.wall_pairs, state.awake)
            self.by_body = np.zeros(count, bool)
            self.by_body[self.touching] = True

    def place_points(self, state: FluidState) -> None:
        """Put places [m] and weights of the particles side by side (N, 4), for those who gather them."""
        self.team.run(fill_rows, state.listed, state.position, self.weight, self.points)

    def relative_speed(self, state: FluidState, fastest: float) -> float:
        """What most speeds [m/s] relative to the neighbourhood keep below (see `time_step`), 0 where it could not shorten a step.

        `fastest` [m/s]: largest speed of all. Of a pair that matters one is faster than half their relative speed.
        """
        config, walls, spacing = self.config, self.walls, self.config.particle_spacing
        if fastest * config.maximum_time_step <= config.cfl * spacing:
            return 0.0
        slow = 0.5 * config.cfl * max(fastest, spacing / config.maximum_time_step)
        twist = walls.twists().astype(np.float32)
        stride = sampling_stride(state.awake)
        square = np.empty(-(-state.awake // stride), np.float32)
        with self.stage("time step"):
            self.team.run(
                relative_speeds, square.size, state.position, state.velocity, walls.position, walls.resting, walls.owner,
                walls.arm, twist, self.period, self.fluid_pairs, self.wall_pairs, np.float32(slow), self.support, stride, square,
            )  # fmt: skip
            return math.sqrt(most(square))

    def pressure_head(self, state: FluidState) -> Real:
        """p / rho [m2/s2] of the last pressure solve in a sample of the particles; 0 before the first."""
        if state.time_step == 0.0:
            return np.zeros(1, np.float32)
        chosen = slice(0, state.awake, sampling_stride(state.awake))
        weight = self._weights[state.phase[chosen]]
        head: Real = state.pressure_impulse[chosen] * (weight / np.float32(state.time_step))
        return head

    def lesser_liquids(self, state: FluidState) -> list[NDArray[np.uint32]]:
        """The awake particles of each liquid but the one that there is most of, with all neighbours: what spreads it is at its rim."""
        if len(self.densities) == 1:
            return []
        phase = state.phase[: state.awake]
        counts = [np.count_nonzero(phase == k) for k in range(len(self.densities))]
        lesser = [k for k, count in enumerate(counts) if count and k != np.argmax(counts)]
        return [indices(self.near_to(state, indices(phase == k))) for k in lesser]

    def near_to(self, state: FluidState, group: NDArray[np.uint32]) -> NDArray[np.bool_]:
        """Which awake particles are of a group or have one of it among their neighbours."""
        near = np.zeros(state.listed, np.uint8)
        self.team.run(mark_around, group.size, group, self.fluid_pairs, near)
        return near[: state.awake].view(np.bool_)

    @property
    def geometry(self) -> tuple[object, ...]:
        """What sums over neighbours need besides positions: periods, pairs, kernel constant, support and volume."""
        return (self.period, self.fluid_pairs, self.wall_pairs, self.sigma, self.support, self.volume)

    def wrap(self, state: FluidState) -> None:
        """Bring particles that crossed a periodic side back in at the other."""
        if self.period is None:
            return
        with self.stage("wrap"):
            for axis, length in enumerate(self.period):
                if length > 0.0:
                    low = np.float32(self.config.lower[axis])
                    state.position[axis] -= length * np.floor((state.position[axis] - low) / length)

    def accelerate(self, state: FluidState, time_step: float) -> None:
        """Gravity on the fluid; on the bodies everything but the fluid."""
        with self.stage("gravity"):
            for axis, g in enumerate(self.config.gravity):
                if g != 0.0:
                    state.velocity[axis, : state.awake] += np.float32(time_step * g)
            for body in self.walls.moving.values():
                body.twist = body.twist + time_step * body.free_acceleration

    def press_films(self, state: FluidState, time_step: float) -> None:
        """Liquid too thin for particles presses on bodies that lie on what is held (see `films`), as in the last step."""
        if not (self.contacts.particle.size and state.time_step > 0.0):
            return
        with self.stage("films"):
            per_kappa = self.reference_density / state.time_step
            liquid = state.pressure_impulse, per_kappa, self.rest_density, state.position
            wrench = film_wrenches(
                self.walls, self.wall_pairs, self.contacts, self.touching, self.points, liquid, self._gravity, self.period,
                (self.sigma, self.support, self.volume, self.moment),
            )  # fmt: skip
            if wrench.any():
                self.walls.receive(time_step * wrench)

    def fly(self, state: FluidState, time_step: float) -> None:
        """Move the particles by their velocities."""
        with self.stage("flight"):
            moving = slice(0, state.awake)
            state.position[:, moving] += np.float32(time_step) * state.velocity[:, moving]
        self.wrap(state)

    def linearise(self, state: FluidState) -> None:
        """Cache pair gradients and what the pressure operator needs of them at the present positions."""
        walls = self.walls
        with self.stage("gradients"):
            self.place_points(state)
            if self.split:
                self.team.run(
                    mend_moments, state.listed, self.points, self.matrix, self.field, self.near, np.float32(self.time_unit), self.plane,
                    *self.geometry, self.mended,
                )  # fmt: skip
            self.team.run(
                cache_gradients, state.awake, self.points, walls.points, self.mended, self.moment, *self.geometry, self._wall_weight,
                self.by_body, self.plane, self._gravity, self.gradient, self.wall_gradient, self.own, self.extrapolation, self.waterline,
                self.lever, self.diagonal, self.coverage, self.wall_slope, self.openness,
            )  # fmt: skip
            self.contacts: Contacts = walls.contacts(self.touching, self.wall_pairs, self.wall_gradient)

    def hold_waterline(self, state: FluidState, time_step: float) -> None:
        """Let walls at rest hold up the water's edge, as far as the pressure of the last step asks (see `wall_extrapolation`)."""
        if self.waterline is None or self.weightless:
            return
        self.team.run(
            hold_waterline, state.awake, self.wall_pairs, self.waterline, state.pressure_impulse, self.pressed(time_step),
            np.float32(time_step), state.velocity,
        )  # fmt: skip

    def pressed(self, time_step: float) -> np.float32:
        """kappa [m2/s] from which on a particle at a free surface bears others, and is no drop: weight's, PRESSED spacings deep."""
        return np.float32(PRESSED * self.config.particle_spacing * math.hypot(*self.config.gravity) * time_step + 1e-20)

    def pressure_response(self, push: Real | None) -> RigidResponse:
        """How bodies answer pressures: in the split scheme to extrapolated ones too, by the `push` (see `pressure_velocity`)."""
        walls, contacts = self.walls, self.contacts
        if self.lever is not None and contacts.particle.size:
            jacobian = np.empty_like(contacts.jacobian)
            reach = np.empty((*jacobian.shape, 3), np.float32)
            extend_contacts(
                contacts, self.points, walls.points, self.period, self.wall_pairs, self.wall_gradient, self._wall_weight,
                walls.resting, walls.owner, walls.arm, self.lever, jacobian, reach,
            )  # fmt: skip
            contacts = Contacts(contacts.particle, contacts.body, jacobian, reach)
        scale = float(self.volume) * self.reference_density
        return RigidResponse(walls, contacts, push, scale)

    def adhere(self, state: FluidState, time_step: float) -> None:
        """Kick velocities by adhesion to walls; moving bodies receive the opposite impulse."""
        if self._adhesion is None:
            return
        walls = self.walls
        with self.stage("adhesion"):
            pull = np.zeros_like(state.velocity)
            self.team.run(
                adhesion_acceleration, state.awake, state.position, walls.position, walls.area,
                state.phase, self._adhesion, self.period, self.wall_pairs, self.support, pull,
            )  # fmt: skip
            state.velocity += np.float32(time_step) * pull
            if self.touching.size:
                force = walls.zero_forces()
                adhesion_reaction(
                    self.touching, state.position, walls.position, walls.area, state.phase, self._adhesion,
                    self.rest_density, self.period, self.wall_pairs, self.support, self.volume, walls.resting, walls.owner,
                    walls.arm, force,
                )  # fmt: skip
                walls.receive(time_step * force)

    def resist(self, state: FluidState, time_step: float) -> int:
        """Viscosity on velocities; returns the iterations of the implicit solve, 0 for an explicit step.

        Liquids so thin that a step changes nothing are owed it (see `deferred_viscosity`).
        """
        config, viscosity = self.config, self._viscosity_of(state)
        if not viscosity.any():
            return 0
        owed = np.where(viscosity > 0.0, state.viscous_time + time_step, 0.0)
        least = NEGLIGIBLE if self.split else 0.0
        span, matrix, number, state.viscous_time = viscosity_due(
            owed, viscosity, self._viscosity, self.densities * config.particle_spacing**2, least
        )
        if span == 0.0:
            return 0
        with self.stage("viscosity"):
            system = self._viscous_system(state, matrix)
            explicit, used = config.explicit_viscosity or is_mild(number), 0
            theta = implicit_share(number) if self.split and not explicit else 1.0
            bodies = self._viscous_response(system, span, theta)
            if explicit:
                system.explicit(state.velocity, self.rest_density, span, bodies)
            else:
                used = system.solve(
                    state.velocity, self.rest_density, span, theta, bodies, config.viscosity_tolerance,
                    config.viscosity_iterations,
                )  # fmt: skip
            if bodies is not None:
                bodies.hand_over(state.velocity, explicit)
        return used

    def _viscosity_of(self, state: FluidState) -> NDArray[np.float64]:
        """Of the liquids of which there are particles that move, 0 of others: what is not there must not cost a solve [Pa s]."""
        phase = state.phase[: state.awake]
        return np.array([mu if mu > 0.0 and (phase == k).any() else 0.0 for k, mu in enumerate(self.viscosities)])

    def _viscous_response(self, system: ViscousSystem, time_step: float, theta: float) -> ViscousResponse | None:
        """How moving bodies answer the drag of liquids that they hold; None where nothing touches one."""
        walls = self.walls
        if not walls.bodies_hold or not self.touching.size:
            return None
        return ViscousResponse(
            walls,
            self.touching,
            self.wall_pairs,
            self.wall_gradient,
            system.wall_stiffness,
            self.volume,
            time_step,
            theta,
        )

    def _viscous_system(self, state: FluidState, viscosity: Real) -> ViscousSystem:
        """Pairs of liquids with a `viscosity` (P, P) [Pa s] and the walls that hold them, at the present positions."""
        config, walls = self.config, self.walls
        viscous = viscosity.max(axis=1) > 0.0
        chosen = np.arange(state.awake) if viscous.all() else np.flatnonzero(viscous[state.phase[: state.awake]])
        system = ViscousSystem(self.team, chosen.astype(np.uint32), self.fluid_pairs, self.gradient)
        no_slip = walls.no_slip
        if no_slip is not None:
            # one sheet of walls, of whatever volume, holds the liquid; points without any are no walls
            held = walls.area * np.float32(wall_factor(config.dimension, not self.split) * config.particle_spacing)
            no_slip = np.divide(no_slip * held, walls.volume, out=np.zeros_like(held), where=walls.volume > 0.0)
        system.assemble(
            self.points, walls.points, state.phase, viscosity, no_slip, self.period, self.wall_pairs, self.wall_gradient,
            config.particle_spacing, config.dimension, self.near if self.split else None,
        )  # fmt: skip
        return system

    def touch_walls(self, state: FluidState, time_step: float) -> None:
        """Inelastic contact of single particles with walls (see `wall_contact`)."""
        if not self.walls.count:
            return
        count, run, contacts = state.awake, self.team.run, self.contacts
        spacing = np.float32(self.config.particle_spacing)
        slope, (rate, strength) = self.wall_slope, np.empty((2, count), np.float32)
        with self.stage("contact"):
            run(wall_approach, count, slope, state.velocity, rate)
            response = RigidResponse(self.walls, contacts, None, float(self.volume))
            if response.present:
                response.add_motion(rate)
            run(
                wall_contact, count, self.coverage, self.compression, self._drop, slope, rate, self._coverages, spacing,
                np.float32(self.config.particle_spacing / time_step), state.velocity, strength,
            )  # fmt: skip
            run(
                wall_push, count, self.coverage, self.compression, self._drop, slope, self._nearest, self._coverages, spacing,
                state.position,
            )  # fmt: skip
            if response.present:
                response.accept(strength * self.rest_density[:count])


def _reserved(kept: NDArray[Any], pairs: Pairs) -> NDArray[Any]:
    """Storage (3, P) for a vector per pair, reused while it is large enough."""
    return kept if kept.shape[1] >= pairs.neighbor.size else np.empty((3, pairs.neighbor.size), kept.dtype)
