"""One time step, stage by stage.

    advect                 x += dt v                                                            `stages.advection`
    part_sleepers          regions at rest fall asleep, others wake                             `stages.sleep`
    search_neighbors       lists of fluid and wall neighbours                                   `stages.search`
    relax_positions        neighbour sums; density, order and quiet: positions move,            `stages.relaxation`
                           velocities only as the flow's field asks
    cache_pair_gradients   pair vectors, the pressure operator's diagonal                       `stages.gradients`
    begin_viscosity        the viscosity that is due; the motion before forces act              `stages.viscosity`
    apply_gravity          v += dt g, bodies: V += dt A                                         `stages.gravity`
    press_films            liquid too thin for particles presses on bodies                      `stages.films`
    apply_forcings         currents, waves, wind                                                `stages.forcing`
    apply_adhesion         liquid is drawn to walls                                             `stages.adhesion`
    apply_tension          interfaces pull along themselves                                    `stages.tension`
    apply_last_pressure    v -= u of the last step's pressure, bodies responding                 `stages.pressure`
    apply_viscosity        implicitly, or explicitly where it is mild                           `stages.viscosity`
    project_velocity       bounded solve for the change of pressure, bodies responding           `stages.pressure`
    apply_wall_contact     single drops meet walls, and no particle goes into a thin plate      `stages.contact`
    project_momentum       liquid off the walls gets lost momentum back                         `momentum_projection`

Positions and velocities are constrained apart: a density error is carried to the next step, not converted into motion. The scheme of
Qiu et al. 2021, which feeds it back, is in `oilsim.step.paper`. Advection comes first and on its own, since bodies and frames may cut a
flight in pieces (see `Fluid.advance`).
"""

from __future__ import annotations

from oilsim.core.state import FluidState
from oilsim.pressure.bounded_solver import BoundConstrainedSolver
from oilsim.step.momentum_projection import MomentumProjection
from oilsim.step.stages.adhesion import apply_adhesion
from oilsim.step.stages.contact import apply_wall_contact
from oilsim.step.stages.films import press_films
from oilsim.step.stages.forcing import Drive
from oilsim.step.stages.gradients import cache_pair_gradients
from oilsim.step.stages.gravity import apply_gravity
from oilsim.step.stages.pressure import apply_last_pressure, project_velocity
from oilsim.step.stages.relaxation import relax_positions
from oilsim.step.stages.search import search_neighbors
from oilsim.step.stages.sleep import part_sleepers
from oilsim.step.stages.tension import apply_tension
from oilsim.step.stages.viscosity import apply_viscosity, begin_viscosity
from oilsim.step.step_arrays import StepArrays, StepResult
from oilsim.step.step_tools import StepTools


def split_step(
    tools: StepTools, arrays: StepArrays, state: FluidState, solver: BoundConstrainedSolver, time_step: float, drive: Drive, driven: bool
) -> StepResult:  # fmt: skip
    """Run, in place, the stages that follow advection in a step of `time_step` [s].

    `drive(dt)` adds currents, waves and wind to the velocities; driven: something moves liquid so.
    """
    part_sleepers(tools, state, time_step, driven)
    search_neighbors(tools, arrays, state)
    momentum = MomentumProjection(tools, arrays, state)
    with momentum.watch():
        density_iterations, density_error = relax_positions(tools, arrays, state, time_step)
    cache_pair_gradients(tools, arrays, state)
    viscous_step = begin_viscosity(tools, state, time_step)
    apply_gravity(tools, state, time_step)
    press_films(tools, arrays, state, time_step)
    drive(time_step)
    with momentum.watch():
        apply_adhesion(tools, arrays, state, time_step)
        apply_tension(tools, arrays, state, time_step)
        operator = apply_last_pressure(tools, arrays, state, time_step)
        viscosity_iterations, viscosity_error = apply_viscosity(tools, arrays, state, viscous_step)
        divergence_iterations, divergence_error = project_velocity(tools, arrays, state, solver, operator)
        apply_wall_contact(tools, arrays, state, time_step)
    momentum.project()
    return StepResult(
        time_step, density_iterations, divergence_iterations, viscosity_iterations, density_error, divergence_error,
        viscosity_error, arrays.crowding,
    )  # fmt: skip
