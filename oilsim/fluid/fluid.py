"""The fluid as a whole: its particles, walls, forcings and emitters, and its steps."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from oilsim.accounts import diagnostics
from oilsim.accounts.budget import Budget
from oilsim.backend.arrays import Array, Flags, Index, Ints
from oilsim.backend.thread_team import Team
from oilsim.boundaries.boundary_particles import BoundaryParticles
from oilsim.boundaries.walls import MovingBody
from oilsim.core.config import FluidConfig
from oilsim.core.state import FluidState, places_of
from oilsim.fluid import checks
from oilsim.fluid.advance_report import AdvanceReport, Unreported
from oilsim.fluid.emitter import PipeEmitter
from oilsim.fluid.paper_scheme import paper_step
from oilsim.fluid.schemes import fall, move, split_step
from oilsim.fluid.time_step import equal_steps, largest_relative_speed, next_time_step, too_fast
from oilsim.fluid.views import FluidView
from oilsim.forcing import Forcing, ForcingView
from oilsim.stages.explicit import apply_forcings
from oilsim.step.arrays import StepArrays, StepResult
from oilsim.step.context import StepClock, StepContext


class FluidError(RuntimeError):
    """The fluid's state has become unusable; the message names the value, its place and the time."""


class Fluid(FluidView):
    """Liquids, walls, and the forcings and pipes that drive them.

    Order of use: add particles, boundaries, emitters and forcings (in any order, at any time between advances); before each
    `advance`, `set_boundary_motion` for every body that moves; after it, `boundary_wrench`. `FluidView` has all that can be read;
    `state`, `context`, `clock` and `arrays` are the solver's own. Units SI, world frame z up. TypeError for another `config`.
    """

    def __init__(self, config: FluidConfig, threads: int | None = None) -> None:
        if not isinstance(config, FluidConfig):
            raise TypeError(f"config is {config!r}, allowed: an oilsim.FluidConfig")
        self.config = config
        self.time = 0.0
        self.state = FluidState(viscous_time=np.zeros(len(config.phases)))
        self.context, self.clock = StepContext.of(config, Team(threads)), StepClock()
        self.arrays = StepArrays.of(self.context)
        self.forcings: list[Forcing] = []
        self.emitters: list[PipeEmitter] = []
        self._stirred = False
        self._duration = 0.0
        self._unreported = Unreported()
        self._relative_speed: float | None = None  # [m/s] at the end of the last step, None if that is not known

    # contents

    def add_particles(self, position: ArrayLike, *, phase: str, velocity: ArrayLike = (0.0, 0.0, 0.0)) -> None:
        """Add particles of a phase at `position` (N, 3) [m] with `velocity` (3,) or (N, 3) [m/s].

        ValueError outside the domain, and where particles lie already.
        """
        index = self.config.phase_index(phase)
        points, speeds = checks.particles(self.config, phase, position, velocity)
        self.finish_step()
        checks.places_of_their_own(self.config, phase, points, self.state.position)
        self._insert(points, speeds, index)

    def _insert(self, points: Array, velocity: Array, phase: int) -> None:
        self.state.append(points, velocity, phase)
        if self.context.regions is not None:
            self.context.regions.wake(points.T.astype(np.float32))
        self._relative_speed = None

    def set_velocities(self, velocity: ArrayLike) -> None:
        """Give all particles velocities (3, N) [m/s] from now on, in the order of `particles` before the call, which finishes the step.

        ValueError for another shape, for numbers that are not finite, and in two dimensions for velocities along y.
        """
        given = checks.velocities(self.config, velocity, self.state.count)
        self.state.velocity[:] = given[:, self._finished()]
        self._disturbed()

    def remove_particles(self, chosen: Flags) -> None:
        """Take out the particles that are True in `chosen` (N,), in the order of `particles` before the call, which finishes the step.

        ValueError for another shape or type.
        """
        marks = np.asarray(chosen)
        if marks.dtype != np.bool_ or marks.shape != (self.state.count,):
            raise ValueError(f"chosen is {marks.dtype} {marks.shape}, allowed: bool ({self.state.count},)")
        if self.state.remove(marks[self._finished()], self.context.team):
            self.context.lists.forget()
        self._disturbed()

    def _finished(self) -> Ints:
        """Finish the step, which may sort particles and take some out; return where those that are left (N,) were before."""
        before = self.state.id
        self.finish_step()
        return places_of(self.state.id, before)

    def swap_particles(self, first: ArrayLike, second: ArrayLike) -> None:
        """Let particles change places in pairs: first, second (n,) ids. Volumes, masses and each pair's momentum stay.

        A particle takes over the velocity of its new place, but for a small change that it shares with its partner (`FluidState.swap`).
        Accounts of energy and momentum book the change as "swaps". It finishes the step. ValueError for ids that occur twice, or that do
        not
        exist then.
        """
        self.finish_step()  # first, because particles may leave
        rows = places_of(checks.pairs_of_ids(first, second, self.state.id), self.state.id)
        with self._swapping(rows.ravel()):
            mass = self.config.rest_volume * np.array([phase.rest_density for phase in self.config.phases])
            self.state.swap(rows[0], rows[1], mass)

    def change_phase(self, ids: ArrayLike, phase: str) -> Index:
        """Let particles become another liquid where they are, at the velocity they have; return their new ids (n,).

        Volumes stay; masses change, which accounts of energy and momentum book as "swaps". An id never changes its phase. It finishes the
        step. ValueError for ids that occur twice, or that do not exist then.
        """
        index = self.config.phase_index(phase)
        self.finish_step()  # first, because particles may leave
        rows = places_of(checks.known_ids(ids, self.state.id), self.state.id)
        fresh = np.arange(self.state.next_id, self.state.next_id + rows.size, dtype=np.uint32)
        with self._swapping(rows):
            self.state.phase[rows], self.state.id[rows] = index, fresh
            self.state.next_id += rows.size
        return fresh

    @contextmanager
    def _swapping(self, rows: Ints) -> Iterator[None]:
        """Book what a block changes of the particles in these rows (n,) of the state as swaps, and wake the water around them."""
        with self.clock.booked(), self.clock.stage("swaps"):
            yield
        self._wake(rows)
        self._relative_speed = None

    def _wake(self, rows: Ints | slice = slice(None)) -> None:
        """Wake the water around the particles in these rows (n,) of the state; all that sleeps, by default."""
        if self.context.regions is not None:
            self.context.regions.wake(self.state.position[:, rows])

    def _disturbed(self) -> None:
        """Wake all that sleeps, and forget how the liquid was last seen to deform."""
        self._wake()
        self._relative_speed = None

    def add_boundary(self, boundary: BoundaryParticles, handle: int | None = None) -> int:
        """Add a solid surface at rest; returns the handle that the other calls take: a new one, or the one that it had before.

        ValueError for a handle that another surface has, and in two dimensions for points off the plane y = 0.
        """
        checks.boundary(self.config, boundary)
        handle = self.context.walls.add(boundary, handle)
        self._walls_changed()
        return handle

    def remove_boundary(self, handle: int) -> None:
        """Remove a solid surface; ValueError for a handle that does not exist."""
        self.context.walls.remove(handle)
        self._walls_changed()

    def _walls_changed(self) -> None:
        """Drop the lists, which know wall particles by their numbers, and wake all that sleeps."""
        self.context.lists.forget()
        self._wake()

    def set_boundary_motion(
        self, handle: int, position: ArrayLike, orientation: ArrayLike, linear_velocity: ArrayLike, angular_velocity: ArrayLike,
        inverse_mass: ArrayLike | None = None, free_acceleration: ArrayLike | None = None,
    ) -> None:  # fmt: skip
        """Set the present pose and twist of a body: centre of mass (3,) [m], quaternion x y z w, velocities [m/s, rad/s], world frame.

        inverse_mass (6, 6): twist per impulse [1/kg, 1/(kg m2)], with which the body responds inside the pressure solve; None moves
        it as prescribed. free_acceleration (6,): d(twist)/dt from everything but the fluid [m/s2, rad/s2].
        """
        motion = MovingBody(
            position=np.array(position, np.float64),
            orientation=np.array(orientation, np.float64),
            twist=np.append(np.asarray(linear_velocity, np.float64), np.asarray(angular_velocity, np.float64)),
            inverse_mass=np.zeros((6, 6)) if inverse_mass is None else np.array(inverse_mass, np.float64),
            free_acceleration=np.zeros(6) if free_acceleration is None else np.array(free_acceleration, np.float64),
        )
        checks.motion(self.config, handle, self.context.walls.boundaries, motion)
        if handle not in self.context.walls.moving:
            self.finish_step()
        change = self.context.walls.set_motion(handle, motion)
        if change * self.config.longest_time_step > self.config.cfl * self.config.particle_spacing:
            self._relative_speed = None  # found before this jump

    def set_joint_inverse_mass(self, handles: Sequence[int], inverse_mass: ArrayLike) -> None:
        """Set the inverse mass (6 n, 6 n) [1/kg, 1/(kg m2)] by which bodies tied by joints respond to impulses together.

        The matrix has the order of `handles`, which must be all the moving ones; ValueError otherwise. Call this after the bodies' motions
        are set, before each advance. The matrix takes the place of their own inverse masses.
        """
        tied = np.array(inverse_mass, np.float64)
        checks.ties(handles, tied, list(self.context.walls.moving))
        self.context.walls.tie(handles, tied)

    def add_forcing(self, forcing: Forcing, *, calms: bool = False) -> None:
        """Add a current, waves or wind; one that only `calms` what moves lets water sleep."""
        self.forcings.append(forcing)
        self._stirred |= not calms

    def add_emitter(self, emitter: PipeEmitter) -> None:
        """Add a pipe; ValueError for a phase that does not exist, in two dimensions, outside the domain, and for half a particle."""
        checks.pipe(self.config, emitter)
        self.emitters.append(emitter)

    def watch(self) -> Budget:
        """Keep accounts of energy and momentum from now on; the state is not changed by it, bit for bit."""
        self.clock.budget = Budget(self.config, self.context.team, self.state, self.context.walls)
        return self.clock.budget

    # how it advances

    def advance(self, duration: float) -> AdvanceReport:
        """Advance by `duration` [s] in CFL sub-steps; ValueError for a duration that is not above 0, FluidError for a value not finite.

        Where bodies move, in the paper's scheme, and as long as nothing is known of how the liquid deforms, a whole number of equal
        steps fills the duration. Else a step goes on into the next advance, unless `finish_step` ends it: particles move with the
        velocities of its beginning, and are seen where they then are.
        """
        if not 0.0 < duration < math.inf:
            raise ValueError(f"duration is {duration} s, allowed: above 0, finite")
        for body in self.context.walls.moving.values():
            body.impulse[:] = 0.0
        if self.clock.budget is not None:
            self.clock.budget.open()
        start, done = self.time, 0.0
        while done < duration * (1.0 - 1e-9):
            done += self._advect(duration - done)
            self.time = start + done
            if self.state.time_left == 0.0:
                self._end_step()
        self.time, self._duration = start + duration, duration
        self._check()
        return self._report()

    def finish_step(self) -> None:
        """End the step that has begun where it is, if one has: after this, velocities are those of the present positions.

        What that changes is in the report of the next advance.
        """
        if self.state.time_left > 0.0:
            passed, self.state.time_left = self.state.step - self.state.time_left, 0.0
            if passed == 0.0:  # the step that has just begun
                return
            self.state.step = passed
            with self.clock.booked():
                self._end_step()

    def _time_step(self) -> float:
        fastest = self._largest_speed()
        step = next_time_step(self.context, self.state, fastest, self._relative_speed)
        fault = too_fast(self.config.particle_spacing, fastest, step) if self.config.scheme == "split" else ""
        if fault:
            raise FluidError(f"at t = {self.time:.6g} s {fault}")
        return step

    def _deformation(self) -> float:
        """Return the speed [m/s] of the liquid relative to itself, as far as it can shorten a step."""
        fastest = self._largest_speed()
        with self.clock.stage("time step"):
            return largest_relative_speed(self.context, self.arrays.neighbors.neighborhood, self.state, fastest)

    def _keeps_step(self) -> bool:
        """Tell whether steps must end where advances do: bodies take part in them, or the liquid's deformation is not known yet."""
        return self.config.scheme == "paper" or bool(self.context.walls.moving) or self._relative_speed is None

    def _advect(self, left: float) -> float:
        """Begin a step if none has begun, and move particles for its rest, but not for more than `left`; returns for how long [s]."""
        state = self.state
        if state.time_left == 0.0:
            wanted = left if self._is_void else self._time_step()
            state.step = state.time_left = equal_steps(left, wanted) if self._keeps_step() else wanted
        span = state.time_left if state.time_left <= left * (1.0 + 1e-9) else left
        with self.clock.stage("emitters"):
            self._emit(span)
        if self.config.scheme == "split":
            move(self.context, self.clock, state, span)
        state.time_left -= span
        return span

    def _end_step(self) -> None:
        """Run the stages of a step where its span ends."""
        time_step = self.state.step
        if self._is_void:
            fall(self.context, self.clock, self.state, time_step)  # and what else acts on bodies
            result = StepResult(time_step, 0, 0, 0, 0.0, 0.0)
        elif self.config.scheme == "paper":
            result = paper_step(self.context, self.clock, self.arrays, self.state, time_step, self._drive)
        else:
            result = split_step(self.context, self.clock, self.arrays, self.state, time_step, self._drive, self._driven)
            self._relative_speed = self._deformation()
        with self.clock.stage("outflow"):
            self._remove_outflow()
        self.context.walls.drift(time_step)
        self._unreported.results.append(result)

    def _emit(self, time_step: float) -> None:
        for emitter in self.emitters:
            entering = emitter.emit(self.time, time_step)
            if len(entering):
                speeds, first = np.broadcast_to(emitter.velocity, entering.shape), self.state.next_id
                self._insert(entering, speeds, self.config.phase_index(emitter.phase))
                emitter.fill(np.arange(first, self.state.next_id, dtype=np.uint32))
                self._unreported.emitted[emitter.phase] += len(entering)
            emitter.hold(self.time, self.state.id, self.state.position, self.state.velocity)

    def _drive(self, time_step: float) -> None:
        if not self.forcings:
            return
        state, constants, awake = self.state, self.context.constants, slice(0, self.state.awake)
        with self.clock.stage("forcing"):
            view = ForcingView(
                self.time, time_step, state.position[:, awake], state.velocity[:, awake], state.phase[awake],
                self.arrays.sums.gradient_sum[:, awake], constants.densities, float(constants.volume),
            )  # fmt: skip
            apply_forcings(self.forcings, view, constants.plane)

    def _remove_outflow(self) -> None:
        outside = diagnostics.outside(self.state.position, self.config)
        if outside.any():
            for index, phase in enumerate(self.config.phases):
                count = int(np.count_nonzero(self.state.phase[outside] == index))
                if count:
                    self._unreported.removed[phase.name] += count
            if self.state.remove(outside, self.context.team):
                self.context.lists.forget()

    def _check(self) -> None:
        if told := diagnostics.not_finite(self.state, self.config, self.time):
            raise FluidError(told)

    def _report(self) -> AdvanceReport:
        sums, budget = self.arrays.sums, None
        if self.clock.budget is not None:
            near = sums.surface if self.context.constants.corrected else None
            budget = self.clock.budget.close(self._duration, sums.compression + np.float32(sums.crowding), near)
        report = self._unreported.report(
            max(0.0, float(sums.compression.max(initial=0.0)) + sums.crowding),
            stage_seconds=dict(self.clock.seconds),
            asleep=self.state.asleep,
            budget=budget,
        )
        self.clock.seconds.clear()
        return report

    def close(self) -> None:
        """End the fluid's threads; its readings stay available."""
        self.context.team.close()

    # saved and restored

    def save_state(self) -> dict[str, Any]:
        """Return everything that `restore_state` needs to continue bit for bit."""
        return {
            "time": self.time,
            "duration": self._duration,
            "made_of": checks.made_of(self.config, self.context.walls.boundaries),
            "unreported": self._unreported.save(),
            "relative_speed": self._relative_speed,
            "state": self.state.save(),
            "regions": None if self.context.regions is None else self.context.regions.save(),
            "bodies": self.context.walls.save_motions(),
            "tied": self.context.walls.tied,
            "forcings": [forcing.save() for forcing in self.forcings],
            "emitters": [emitter.save() for emitter in self.emitters],
        }

    def restore_state(self, saved: dict[str, Any]) -> None:
        """Restore the state that `save_state` returned; ValueError unless the fluid holds the same boundaries, forcings and emitters."""
        checks.saved_state(
            saved, self.config, self.context.walls.boundaries, self.context.regions, self.forcings, self.emitters
        )
        self.time, self._duration = saved["time"], saved["duration"]
        self._relative_speed = saved["relative_speed"]
        self.state.restore(saved["state"])
        self.context.lists.forget()
        if self.context.regions is not None:
            self.context.regions.restore(saved["regions"])
        self.context.walls.restore_motions(saved["bodies"], saved["tied"])
        for forcing, values in zip(self.forcings, saved["forcings"], strict=True):
            forcing.restore(values)
        for emitter, values in zip(self.emitters, saved["emitters"], strict=True):
            emitter.restore(values)
        self._unreported.restore(saved["unreported"])
        self.clock.seconds.clear()
        if self.clock.budget is not None:
            self.clock.budget.begin_anew()
