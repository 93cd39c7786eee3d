"""The exchange between a scenario's bodies and its fluid: the scheme for each body, and the accounts."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from coupling.master.body_exchange import BodyExchange, BodyInterface
from coupling.master.exchange_ledger import BodyBond, ExchangeLedger
from coupling.participants.fluid import FluidParticipant
from coupling.rigid.rigid_body_world import RigidBodyWorld
from oilsim.config import FluidConfig


def exchange_of(
    fluid: FluidParticipant, bodies: str, world: RigidBodyWorld | None, coupled: Sequence[str], config: FluidConfig
) -> tuple[BodyExchange, ExchangeLedger]:
    """Create the algorithm and the ledger for the free ones of the `coupled` bodies of the participant `bodies`."""
    free = () if world is None else world.free_body_names
    names = [name for name in coupled if name in free]
    interfaces = [
        BodyInterface(
            body=name,
            fluid=fluid.name,
            solver=bodies,
            added_mass=partial(fluid.added_mass, name),
            mass_matrix=None if world is None else partial(world.mass_matrix, name),
            gravity=config.gravity,
        )
        for name in names
    ]
    exchange = BodyExchange(interfaces)
    bonds = [BodyBond(name, fluid.name, bodies) for name in names]
    return exchange, ExchangeLedger(
        bonds, config.particle_spacing, disturbed=lambda: () if world is None else world.disturbed
    )
