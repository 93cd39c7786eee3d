"""One time step, stage by stage.

    advect                 x += dt v                                                            `stages.explicit`
    part_sleepers          regions at rest fall asleep, others wake                             `sleeping_regions`
    search_neighbors       lists of fluid and wall neighbours                                   `stages.pairs`
    relax_positions        neighbour sums; density, order and smoothing: positions move,        `stages.relaxation`
                           velocities only as the flow's field asks
    cache_pair_gradients   pair vectors, the pressure operator's diagonal                       `stages.pairs`
    begin_viscosity        the viscosity that is due; the motion before forces act              `stages.viscosity`
    add_gravity            v += dt g, bodies: V += dt A                                         `stages.explicit`
    press_films            liquid too thin for particles presses on bodies                      `stages.explicit`
    apply_forcings         currents, waves, wind                                                `stages.explicit`
    apply_adhesion         liquid is drawn to walls                                             `stages.explicit`
    apply_tension          interfaces pull along themselves                                     `stages.explicit`
    apply_last_pressure    v -= u of the last step's pressure, bodies responding                `stages.pressure`
    apply_viscosity        implicitly, or explicitly where it is mild                           `stages.viscosity`
    project_velocity       bounded solve for the change of pressure, bodies responding          `stages.pressure`
    apply_wall_contact     single drops meet walls, and no particle goes into a thin plate      `stages.contact`
    project_momentum       liquid off the walls gets lost momentum back                         `momentum_projection`
    move_drops             drops finer than the flow rise or sink by changing places            `stages.contact`

Positions and velocities are constrained apart: a density error is carried to the next step, not converted into motion. The scheme of
Qiu et al. 2021, which feeds it back, is in `oilsim.fluid.paper_scheme`. Advection comes first and on its own, since bodies and frames may
cut it in pieces (see `Fluid.advance`). Stages take the arrays that they read, and return what they make; this file alone knows their order,
their clock, and where their results go.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oilsim.backend.arrays import Index
from oilsim.core.state import FluidState
from oilsim.stages.contact import apply_wall_contact, move_drops
from oilsim.stages.explicit import Drive, add_gravity, advect, apply_adhesion, apply_tension, press_films, wrap_periodic
from oilsim.stages.pairs import cache_pair_gradients, search_neighbors
from oilsim.stages.pressure import apply_last_pressure, minority_phases, project_velocity
from oilsim.stages.relaxation import relax_positions
from oilsim.stages.viscosity import ViscousStep, apply_viscosity, begin_viscosity, viscous_system
from oilsim.step.arrays import StepArrays, StepResult
from oilsim.step.context import StepClock, StepContext
from oilsim.step.momentum_projection import MomentumProjection


def split_step(
    context: StepContext, clock: StepClock, arrays: StepArrays, state: FluidState, time_step: float, drive: Drive, driven: bool
) -> StepResult:  # fmt: skip
    """Run, in place, the stages that follow advection in a step of `time_step` [s].

    `drive(dt)` adds currents, waves and wind to the velocities; driven: something moves liquid so.
    """
    _part_sleepers(context, clock, state, time_step / arrays.sums.time_unit, driven)
    find_neighbors(context, clock, arrays, state)
    momentum = MomentumProjection(context, clock, arrays.neighbors, state)
    with momentum.watch(), clock.stage("density"):
        arrays.sums, passes, density_error = relax_positions(
            context, arrays.neighbors, state, time_step, arrays.sums.time_unit
        )
        if clock.budget is not None:
            clock.budget.add_strain(arrays.sums.flow, time_step)
    cache_gradients(context, clock, arrays, state)
    viscous_step = begin_viscosity(context, state, time_step)
    fall(context, clock, state, time_step)
    _press_films(context, clock, arrays, state, time_step)
    drive(time_step)
    with momentum.watch():
        attract(context, clock, arrays, state, time_step)
        with clock.stage("divergence"):
            operator = apply_last_pressure(
                context, arrays.neighbors, arrays.pairs, arrays.sums.surface, state, time_step
            )
        viscous = let_viscosity_act(context, clock, arrays, state, viscous_step)
        with clock.stage("divergence"):
            minor = minority_phases(context, arrays.neighbors, state.phase)
            pressure = project_velocity(context, arrays.neighbors, arrays.sums, arrays.pairs, state, operator, minor)
        meet_walls(context, clock, arrays, state, time_step)
    momentum.project()
    drops = _move_drops(context, clock, arrays, minor, state, time_step)
    return StepResult(
        time_step, passes, pressure[0], viscous[0], density_error, pressure[1], viscous[1], arrays.sums.crowding, drops
    )


def _move_drops(
    context: StepContext, clock: StepClock, arrays: StepArrays, minor: list[Index], state: FluidState, time_step: float
) -> int:
    """Let drops that are finer than the flow rise or sink, where there are two liquids and gravity; returns how many changed places.

    Water around a drop that is on its way does not sleep.
    """
    state.steps += 1
    if context.constants.drop_speeds is None or not minor:
        return 0
    with clock.stage("swaps"):
        count, drops = move_drops(context, arrays.neighbors, minor, state, time_step)
    if context.regions is not None:
        context.regions.wake(state.position[:, drops])
    return count


def _part_sleepers(context: StepContext, clock: StepClock, state: FluidState, elapsed: float, driven: bool) -> None:
    """Sort particles that sleep behind those that are awake; elapsed: time in units of the flow's [1]."""
    if context.regions is None:
        return
    with clock.stage("sleep"):
        parting = context.regions.update(state, context.walls, elapsed, driven)
    if parting is not None:
        with clock.stage("search"):  # whose accounts follow the particles' order
            state.take(parting.order, context.team)
            state.asleep, state.bordering = parting.asleep, parting.bordering
            context.lists.forget()


def find_neighbors(context: StepContext, clock: StepClock, arrays: StepArrays, state: FluidState) -> None:
    """List all neighbours at the present positions."""
    with clock.stage("search"):
        arrays.neighbors = search_neighbors(context, state)


def cache_gradients(context: StepContext, clock: StepClock, arrays: StepArrays, state: FluidState) -> None:
    """Store the pair vectors at the present positions."""
    with clock.stage("gradients"):
        arrays.pairs = cache_pair_gradients(context, arrays.neighbors, arrays.sums, state.position, arrays.pairs)


def move(context: StepContext, clock: StepClock, state: FluidState, time_step: float) -> None:
    """Move the particles by their velocities for `time_step` [s]."""
    with clock.stage("advection"):
        advect(state.position[:, : state.awake], state.velocity[:, : state.awake], time_step)
    if context.constants.period is not None:
        with clock.stage("wrap"):
            wrap_periodic(state.position, context.config.lower, context.constants.period)


def fall(context: StepContext, clock: StepClock, state: FluidState, time_step: float) -> None:
    """Let gravity act on the liquid for `time_step` [s], and everything but the liquid on the bodies."""
    with clock.stage("gravity"):
        add_gravity(state.velocity[:, : state.awake], context.config.gravity, time_step)
        context.walls.move_freely(time_step)


def _press_films(
    context: StepContext, clock: StepClock, arrays: StepArrays, state: FluidState, time_step: float
) -> None:
    contacts = arrays.pairs.contacts
    if contacts.particle.size and state.time_step > 0.0:
        with clock.stage("films"):
            force = press_films(context, arrays.neighbors, contacts, state)
            _give(context, force if force.any() else None, time_step)


def attract(context: StepContext, clock: StepClock, arrays: StepArrays, state: FluidState, time_step: float) -> None:
    """Let adhesion and interfacial tension act for `time_step` [s], where some liquid has any."""
    neighbors, velocity, phase = arrays.neighbors, state.velocity, state.phase
    if context.constants.adhesion is not None:
        with clock.stage("adhesion"):
            _give(context, apply_adhesion(context, neighbors, state.position, phase, velocity, time_step), time_step)
    if context.constants.tensions is not None:
        with clock.stage("tension"):
            _give(context, apply_tension(context, neighbors, phase, velocity, time_step), time_step)


def _give(context: StepContext, force: NDArray[np.float64] | None, time_step: float) -> None:
    """Give moving bodies the impulse of a force (bodies, 6) [N, N m], if there is any, over `time_step` [s]."""
    if force is not None:
        context.walls.receive(time_step * force)


def let_viscosity_act(
    context: StepContext, clock: StepClock, arrays: StepArrays, state: FluidState, step: ViscousStep
) -> tuple[int, float]:
    """Let the viscosity that is due act; returns iterations and what they leave [1]."""
    if step.due.span == 0.0:
        return 0, 0.0
    neighbors, pairs = arrays.neighbors, arrays.pairs
    with clock.stage("viscosity"):
        surface = arrays.sums.surface if context.constants.corrected else None
        system = viscous_system(context, neighbors, pairs, state.phase, surface, step.due.matrix)
        return apply_viscosity(context, system, neighbors, pairs, state.velocity, step)


def meet_walls(context: StepContext, clock: StepClock, arrays: StepArrays, state: FluidState, time_step: float) -> None:
    """Let single particles meet walls, if there are any, in a step of `time_step` [s]."""
    if context.walls.count:
        with clock.stage("contact"):
            compression, position, velocity = arrays.sums.compression, state.position, state.velocity
            apply_wall_contact(context, arrays.neighbors, arrays.pairs, compression, position, velocity, time_step)
