"""Coupled runs: a master, participants, rigid bodies with joints and lines, pybullet, FMUs, and the plugin for a pybullet program.

The public names are those of `__all__`. Each is imported when it is first used: `import coupling` alone loads neither pybullet nor FMPy.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from coupling.bullet.assembly import CoupledBodies, ExchangeOptions, couple_participant, couple_world
    from coupling.bullet.plugin import FluidWorld, attach_fluid
    from coupling.bullet.rigid_body_participant import RigidBodyParticipant
    from coupling.bullet.rigid_body_world import RigidBodyWorld
    from coupling.fmu.fmu_participant import FmuParticipant
    from coupling.fmu.isolated_fmu import IsolatedFmu
    from coupling.fmu.scalar_model import ScalarModel, given, parameter, taken
    from coupling.master.body_exchange import Scheme
    from coupling.master.co_simulation import CoSimulation
    from coupling.master.connection import Connection
    from coupling.master.errors import CoSimulationError, CouplingSetupError, UnresolvedSolidError
    from coupling.master.observer_dispatch import Observer, Watching
    from coupling.master.participant import Causality, Participant, Status, StepResult, Variable
    from coupling.multibody.prescribed_motion import Motion, OscillatingMotion
    from coupling.participants.fluid import FluidParticipant
    from coupling.participants.slick import SlickParticipant
    from coupling.solids.bodies import box, capsule, cylinder, load_mesh, mass_properties, sphere
    from coupling.solids.surface_sampling import boundary_particles

__all__ = [
    "Causality",
    "CoSimulation",
    "CoSimulationError",
    "Connection",
    "CoupledBodies",
    "CouplingSetupError",
    "ExchangeOptions",
    "FluidParticipant",
    "FluidWorld",
    "FmuParticipant",
    "IsolatedFmu",
    "Motion",
    "Observer",
    "OscillatingMotion",
    "Participant",
    "RigidBodyParticipant",
    "RigidBodyWorld",
    "ScalarModel",
    "Scheme",
    "SlickParticipant",
    "Status",
    "StepResult",
    "UnresolvedSolidError",
    "Variable",
    "Watching",
    "attach_fluid",
    "boundary_particles",
    "box",
    "capsule",
    "couple_participant",
    "couple_world",
    "cylinder",
    "given",
    "load_mesh",
    "mass_properties",
    "parameter",
    "sphere",
    "taken",
]

_HOMES = {
    "bullet.assembly": "CoupledBodies ExchangeOptions couple_participant couple_world",
    "bullet.plugin": "FluidWorld attach_fluid",
    "bullet.rigid_body_participant": "RigidBodyParticipant",
    "bullet.rigid_body_world": "RigidBodyWorld",
    "fmu.fmu_participant": "FmuParticipant",
    "fmu.isolated_fmu": "IsolatedFmu",
    "fmu.scalar_model": "ScalarModel given parameter taken",
    "master.body_exchange": "Scheme",
    "master.co_simulation": "CoSimulation",
    "master.connection": "Connection",
    "master.errors": "CoSimulationError CouplingSetupError UnresolvedSolidError",
    "master.observer_dispatch": "Observer Watching",
    "master.participant": "Causality Participant Status StepResult Variable",
    "multibody.prescribed_motion": "Motion OscillatingMotion",
    "participants.fluid": "FluidParticipant",
    "participants.slick": "SlickParticipant",
    "solids.bodies": "box capsule cylinder load_mesh mass_properties sphere",
    "solids.surface_sampling": "boundary_particles",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used; AttributeError for another one."""
    for home, names in _HOMES.items():
        if name in names.split():
            return getattr(import_module(f"coupling.{home}"), name)
    raise AttributeError(f"module 'coupling' has no attribute {name!r}, allowed: {', '.join(__all__)}")
