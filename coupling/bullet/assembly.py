"""Fluid and bodies under one master, put together the same way by scenarios, test kit and plugin.

Each body tells the fluid its motion, and takes the fluid's wrench:

    bodies:<body>.pose, .twist, .free_acceleration  ->  fluid:<body>.pose, .twist, .free_acceleration
    bodies:inverse_mass                             ->  fluid:inverse_mass, of all bodies together, joints included
    fluid:<body>.wrench                             ->  bodies:<body>.wrench

Bodies that tell how they answer an impulse, as all bodies here can, are coupled inside the pressure solve. Another scheme of
`coupling.master.body_exchange` may be asked for, which sets the fluid's idea of a body's answer itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from coupling.bullet.client_links import ClientLinks
from coupling.bullet.client_links_participant import ClientLinksParticipant, link_name
from coupling.bullet.links import LinkKey
from coupling.bullet.rigid_body_participant import Requested, RigidBodyParticipant
from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.master.algorithms import Aitken, Iteration
from coupling.master.body_exchange import BodyExchange, BodyInterface, Scheme, require_scheme
from coupling.master.co_simulation import CoSimulation
from coupling.master.connection import Connection
from coupling.master.exchange_ledger import ENERGY_LIMIT, GAUSS_SEIDEL, BodyBond, Exchange, ExchangeLedger
from coupling.master.observer_dispatch import NOBODY, Watching
from coupling.master.participant import Participant
from coupling.participants.fluid import FluidParticipant
from oilsim import Fluid

FLUID, BODIES = "fluid", "bodies"
MOTION = ("pose", "twist")  # of a body, as any scheme needs it


@dataclass(frozen=True, kw_only=True)
class ExchangeOptions:
    """Options of the coupling between the fluid and all bodies of a run.

    scheme: one of `coupling.master.body_exchange`; None couples the bodies inside the pressure solve. iteration: used where the scheme
    iterates. energy_limit [-]: the limit of the ledger. Raises TypeError for a scheme that is not a `Scheme`.
    """

    scheme: Scheme | None = None
    iteration: Callable[[float], Iteration] = Aitken
    energy_limit: float = ENERGY_LIMIT

    def __post_init__(self) -> None:
        require_scheme("scheme of the bodies", self.scheme)

    @property
    def bodies_give_mobility(self) -> bool:
        """True if the bodies tell the fluid themselves how they answer an impulse."""
        return self.scheme in (None, Scheme.MONOLITHIC)


MONOLITHIC = ExchangeOptions()


def _as_it_is(participant: Participant) -> Participant:
    return participant


@dataclass(frozen=True, kw_only=True, eq=False)
class CoupledBodies:
    """A fluid and the bodies that exchange motion and wrench with it, ready for a master.

    bodies: None if the fluid is alone. exchange, ledger: schemes and accounts of the free bodies of a `RigidBodyWorld`. Both are empty for
    links of a client that the user owns: all of these are coupled inside the pressure solve.
    """

    fluid: FluidParticipant
    bodies: Participant | None
    connections: tuple[Connection, ...]
    exchange: BodyExchange
    ledger: ExchangeLedger

    @property
    def participants(self) -> tuple[Participant, ...]:
        """Fluid and bodies, in the order in which they step."""
        return (self.fluid,) if self.bodies is None else (self.fluid, self.bodies)

    def co_simulation(
        self,
        step_size: float,
        *,
        others: Sequence[Participant] = (),
        connections: Sequence[Connection] = (),
        alter: Callable[[Participant], Participant] = _as_it_is,
        watching: Watching = NOBODY,
    ) -> CoSimulation:
        """Create the run of fluid and bodies, in communication steps of `step_size` [s].

        others: further participants, which step first, with their `connections`. alter: returns what takes part in each one's place.
        """
        exchange = Exchange(self.exchange, self.ledger) if self.exchange.interfaces else GAUSS_SEIDEL
        participants = [alter(one) for one in (*others, *self.participants)]
        return CoSimulation(
            participants, (*connections, *self.connections), step_size, exchange=exchange, watching=watching
        )


def couple_world(
    fluid: Fluid,
    handles: Mapping[str, int],
    world: RigidBodyWorld | None,
    options: ExchangeOptions = MONOLITHIC,
    requested: Requested | None = None,
) -> CoupledBodies:
    """Couple a fluid with bodies of a rigid body world.

    handles: the fluid's boundary of each body, by the body's name. world: None if the fluid has no bodies. requested: the variables
    that others ask of the bodies, all if None.
    """
    return couple_participant(FluidParticipant(FLUID, fluid, handles), fluid, tuple(handles), world, options, requested)


def couple_participant(
    participant: FluidParticipant,
    fluid: Fluid,
    names: tuple[str, ...],
    world: RigidBodyWorld | None,
    options: ExchangeOptions = MONOLITHIC,
    requested: Requested | None = None,
) -> CoupledBodies:
    """Couple a fluid's own participant, called FLUID, with the named bodies of a rigid body world, which it has variables of.

    requested: the variables that others ask of the bodies, all if None.
    """
    free_names = () if world is None else world.free_body_names
    free = [name for name in names if name in free_names]
    interfaces = [
        BodyInterface(
            body=name,
            fluid=FLUID,
            solver=BODIES,
            added_mass=partial(participant.added_mass, name),
            mass_matrix=None if world is None else partial(world.mass_matrix, name),
            gravity=fluid.config.gravity,
            scheme=options.scheme,
        )
        for name in free
    ]
    return CoupledBodies(
        fluid=participant,
        bodies=None
        if world is None
        else RigidBodyParticipant(
            BODIES,
            world,
            names if options.bodies_give_mobility else (),
            gives_mobility=bool(names),
            requested=requested,
        ),
        connections=body_connections(names, answer=options.bodies_give_mobility),
        exchange=BodyExchange(interfaces, iteration=options.iteration),
        ledger=ExchangeLedger(
            [BodyBond(name, FLUID, BODIES) for name in free],
            fluid.config.particle_spacing,
            energy_limit=options.energy_limit,
            disturbed=lambda: () if world is None else world.disturbed,
        ),
    )


def couple_client(fluid: Fluid, handles: Mapping[LinkKey, int], links: ClientLinks, step_size: float) -> CoupledBodies:
    """Couple a fluid with links of a client that the user owns, whose time step is `step_size` [s].

    The fluid and the client remain the user's. handles: the fluid's boundary of each link in `links` that meets the fluid.
    """
    named = {link_name(key): handles[key] for key in links.met}
    return CoupledBodies(
        fluid=FluidParticipant(FLUID, fluid, named, own_step=step_size),
        bodies=ClientLinksParticipant(BODIES, links),
        connections=body_connections(tuple(named)),
        exchange=BodyExchange(()),
        ledger=ExchangeLedger((), fluid.config.particle_spacing),
    )


def body_connections(names: Sequence[str], *, answer: bool = True) -> tuple[Connection, ...]:
    """List the connections that carry the motion of the named bodies to the fluid, and the fluid's wrenches to them.

    If the bodies `answer` impulses themselves, the connections also carry their free accelerations and their inverse mass.
    """
    told = (*MOTION, "free_acceleration") if answer else MOTION
    motion = [Connection(BODIES, f"{name}.{what}", FLUID, f"{name}.{what}") for name in names for what in told]
    wrenches = [Connection(FLUID, f"{name}.wrench", BODIES, f"{name}.wrench") for name in names]
    together = [Connection(BODIES, "inverse_mass", FLUID, "inverse_mass")] if names and answer else []
    return (*motion, *wrenches, *together)
