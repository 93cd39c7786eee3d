"""Adds oil and water to an existing pybullet world.

    fluid = Fluid(config)
    fluid.add_particles(...)
    world = attach_fluid(client, fluid, [boat, rock])
    while ...:
        world.step()                      # instead of pybullet.stepSimulation()

Every link with a collision shape gets wall particles from that shape. Fluid and client step under the master of all coupled runs
(`coupling.bullet.assembly`). In each step the fluid takes poses, velocities and inverse masses of the links, joints and constraints
included, and advances by the client's own time step. Then the wrenches act on the links as external forces, and pybullet steps. No
setting of the client is changed: neither gravity nor damping, time step or sub-steps. If a default of pybullet distorts the physics, a
warning says so once and names the call that sets it right.
"""

from __future__ import annotations

import itertools
import warnings
import weakref
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from coupling.bullet.assembly import CoupledBodies, couple_client
from coupling.bullet.attachment_warnings import PlacedWalls, tell_liquid_within, tell_overlaps, tell_thin_parts
from coupling.bullet.client_links import ClientLinks
from coupling.bullet.client_links_participant import link_name
from coupling.bullet.default_warnings import DefaultsWatch, tell_inertia
from coupling.bullet.links import LinkedBody, LinkKey, LinkSystem
from coupling.bullet.pybullet_import import pybullet
from coupling.bullet.shapes import given_solid, link_mesh, link_pose
from coupling.master.blas_threads import one_blas_thread
from coupling.master.co_simulation import CoSimulation
from coupling.master.errors import CoSimulationError, UnresolvedSolidError
from coupling.solids.signed_distance import Box
from coupling.solids.surface_sampling import SurfaceSampling, particles_of, sample_surface
from coupling.solids.thin_parts import HELD
from oilsim import AdvanceReport, Fluid
from oilsim.backend.arrays import Array
from oilsim.core.phases import RIGHT_ANGLE

NOWHERE = np.full(3, np.inf)
JUMP = 0.5  # spacings: a link that moves this much further in a step than its velocity takes it was set elsewhere by somebody


class FluidWorld:
    """A pybullet client with a fluid in it; create it by `attach_fluid`.

    Raises TypeError for a fluid that is no `oilsim.Fluid` and for a client that is no number, ValueError for a fluid of two
    dimensions or in another world, and for a client that is not connected.
    """

    def __init__(self, client: int, fluid: Fluid) -> None:
        if not isinstance(fluid, Fluid):
            raise TypeError(f"fluid is {fluid!r}, allowed: an oilsim.Fluid")
        if fluid.config.dimension != 3:
            raise ValueError(f"fluid has {fluid.config.dimension} dimensions, allowed: 3, as the bodies of pybullet")
        self.fluid = fluid
        self._client = client
        self._links = ClientLinks(client)
        self._handles: dict[LinkKey, int] = {}  # of sampled links
        self._coupled: CoupledBodies | None = None  # with the bodies as they are, once they have stepped
        self._run: CoSimulation | None = None
        self._cut: dict[int, Array] = {}  # poses of bodies that are sampled in part
        self._solids: dict[LinkKey, trimesh.Trimesh] = {}  # of sampled links that may be set elsewhere
        self._places: dict[LinkKey, Array] = {}  # (3,) [m] of all links at the last step
        self._samplings: dict[tuple[bytes, bytes, float], SurfaceSampling] = {}  # by vertices and faces
        self._watch = DefaultsWatch(client, fluid.config.gravity)
        self._has_stepped = self._is_told = False
        self._require_client()
        self._detached = False
        worlds = _WORLDS.setdefault(fluid, weakref.WeakSet())
        if any(one is not self and not one._detached for one in worlds):
            raise ValueError("fluid is in another world already, allowed: one world for each Fluid, until its detach()")
        worlds.add(self)

    @property
    def client(self) -> int:
        """Number of the pybullet client, as `pybullet.connect` returned it."""
        return self._client

    def add_body(
        self,
        body: int,
        *,
        no_slip: bool = False,
        contact_angle: float = RIGHT_ANGLE,
        meshes: Mapping[int, trimesh.Trimesh] | None = None,
    ) -> None:
        """Add a body of the client, which meets the fluid from now on; links smaller than a particle are left out with a warning.

        no_slip: viscous liquids stick to the body. contact_angle [deg] at which interfaces meet it, through the liquid with the larger
        interfacial tension. meshes: closed solids of links by the link's index, about the link's centre of mass [m];
        they replace the collision shapes that pybullet reports, and are needed for meshes made from vertices and indices in memory, which
        pybullet does not report. Raises ValueError if no link is left, if the body is unknown to the client or is not made of links, if it
        meets the fluid already, and for a mesh that is no solid; TypeError for an argument of another type.
        """
        self._require_client()
        self._require_attached()
        if body in self._links.bodies:
            raise ValueError(f"body {body} meets the fluid already, allowed: to add it once")
        if not isinstance(no_slip, bool):
            raise TypeError(f"no_slip is {no_slip!r}, allowed: True or False")
        if not isinstance(meshes or {}, Mapping):
            raise TypeError(f"meshes is a {type(meshes).__name__}, allowed: solids by the index of their link")
        linked, given, liquid = LinkedBody(self._client, body), dict(meshes or {}), self.fluid.particles.position.T
        for link, mesh in given.items():
            if (body, link) not in linked.keys:
                raise ValueError(f"meshes of body {body} has the link {link}, allowed: -1 to {len(linked.keys) - 2}")
            given[link] = given_solid(
                mesh, f"meshes[{link}] of body {body}", link_pose(self._client, body, link), liquid
            )
        sampled: dict[LinkKey, SurfaceSampling] = {}
        solids: dict[LinkKey, trimesh.Trimesh] = {}
        for key in linked.keys:
            mesh = given[key[1]] if key[1] in given else link_mesh(self._client, *key, liquid)
            sampling = None if mesh is None else self._sampled(key, mesh)
            if mesh is not None and sampling is not None:
                self._tell_inertia(key, mesh)
                tell_thin_parts(_label(key), sampling, float(mesh.volume))
                sampled[key], solids[key] = sampling, mesh
        if not sampled:
            raise ValueError(f"body {body} has no collision shape that the fluid can see, allowed: one link at least")
        self._tell_overlaps(sampled)
        for key, sampling in sampled.items():
            particles = particles_of(f"{body}/{key[1]}", sampling, no_slip=no_slip, contact_angle=contact_angle)
            self._handles[key] = self.fluid.add_boundary(particles)
        self._links.add(linked, sampled)
        self._run = None
        self._solids |= {} if body in self._cut else solids

    def remove_body(self, body: int) -> None:
        """Take a body out of the fluid, before or after its removal from the client; ValueError if it does not meet the fluid."""
        bodies = self._links.bodies
        if body not in bodies:
            raise ValueError(f"body {body} does not meet the fluid, allowed: {', '.join(map(str, bodies)) or 'none'}")
        self._cut.pop(body, None)
        self._watch.forget(body)
        for key in bodies[body].keys:
            self._solids.pop(key, None)
            self._places.pop(key, None)
            if key in self._handles:
                self.fluid.remove_boundary(self._handles.pop(key))
        self._links.remove(body)
        self._run = None

    def detach(self) -> None:
        """Take every body out of the fluid, and end this world; a second call does nothing."""
        for body in list(self._links.bodies):
            self.remove_body(body)
        self._detached = True

    def meets(self, body: int, link: int = -1) -> bool:
        """Tell whether a link meets the fluid."""
        return (body, link) in self._handles

    def wrench(self, body: int, link: int = -1) -> Array:
        """Return the fluid's wrench (6,) on a link, the mean over the last step: force [N], and torque about its centre of mass [N m].

        Raises ValueError for a link that does not meet the fluid.
        """
        if not self.meets(body, link):
            met = ", ".join(map(link_name, self._handles)) or "none"
            raise ValueError(f"link {link} of body {body} does not meet the fluid, allowed (body/link): {met}")
        return self._links.wrench((body, link))

    @one_blas_thread()
    def step(self) -> AdvanceReport:
        """Advance fluid and client by the client's own time step; call it instead of `pybullet.stepSimulation`.

        Raises ValueError for a client that is not connected, settings with which no step is possible, a body that has been removed or
        replaced, and boundaries that something else moves. An error of the fluid or of a body is raised as it is.
        """
        self._require_client()
        self._require_attached()
        self._require_alone()
        self._require_only_mover()
        observed = self._links.observe()
        self._refuse_cut_that_moved(observed.system)
        self._tell_liquid_within(observed.system, observed.duration)
        report = self._step_coupled(observed.duration)
        assert self._links.outcome is not None
        self._watch.look(self._links.bodies, self._links.outcome)
        return report

    def _step_coupled(self, duration: float) -> AdvanceReport:
        """Make one step of the master; its run begins anew if bodies or the time step changed, or if the last step failed."""
        run = self._run
        if run is None or not run.is_running or run.communication_point.step_size != duration:
            self._coupled = couple_client(self.fluid, self._handles, self._links, duration)
            run = self._run = self._coupled.co_simulation(duration)
            run.initialize()
        try:
            run.step()
        except CoSimulationError as error:
            failure = error.__cause__ or error  # as if nobody stood between the user and what failed
        else:
            assert self._coupled is not None and self._coupled.fluid.report is not None
            return self._coupled.fluid.report
        raise failure

    def save_state(self) -> dict[str, Any]:
        """Return the state of the fluid and all that was learnt of the bodies' forces; `pybullet.saveState` saves the bodies themselves."""
        return {"fluid": self.fluid.save_state(), "links": self._links.save_state()}

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to a state that `save_state` returned; ValueError if it was saved with other bodies.

        Call `pybullet.restoreState` with the client's state of the same moment as well.
        """
        if not isinstance(saved, Mapping) or not {"fluid", "links"} <= set(saved):
            raise ValueError(f"state is of type {type(saved).__name__}, allowed: what save_state() returned")
        self._links.require_same_bodies(saved["links"])
        self.fluid.restore_state(saved["fluid"])
        self._links.restore_state(saved["links"])

    def _tell_overlaps(self, sampled: Mapping[LinkKey, SurfaceSampling]) -> None:
        """Warn of links about to be added that lie in each other, or in anything that the fluid meets."""
        walls, handles = self.fluid.boundaries, set(self._handles.values())
        others = {
            f"boundary {handle} ({one.name})": PlacedWalls(one.position, one.volume)
            for handle, one in walls.items()
            if handle not in handles
        }
        solids = {_label(key): self._placed(key, one.position, one.volume) for key, one in sampled.items()}
        points, reach = np.concatenate([one.position for one in solids.values()]), self.fluid.config.particle_spacing
        low, high = points.min(axis=0) - reach, points.max(axis=0) + reach
        for key, handle in self._handles.items():  # to turn the walls of all bodies would take long
            one, place = walls[handle], link_pose(self._client, *key)[0]
            extent = float(np.linalg.norm(one.position, axis=1).max(initial=0.0))
            if ((place > low - extent) & (place < high + extent)).all():
                others[_label(key)] = self._placed(key, one.position, one.volume)
        tell_overlaps(solids, others, self.fluid.config.particle_spacing)

    def _tell_liquid_within(self, system: LinkSystem, duration: float) -> None:
        """Warn of liquid in links that have just been added, or that somebody has set elsewhere since the last step."""
        spacing, places = self.fluid.config.particle_spacing, system.pose[:, :3]
        reach = JUMP * spacing + duration * np.linalg.norm(system.twist[:, :3], axis=1)
        before = np.array([self._places.get(key, NOWHERE) for key in system.keys]).reshape(-1, 3)
        self._places = dict(zip(system.keys, places, strict=True))
        for row in np.flatnonzero(np.linalg.norm(places - before, axis=1) > reach):
            key, turn = system.keys[row], Rotation.from_quat(system.pose[row, 3:])
            if key in self._solids:
                liquid = turn.inv().apply(self.fluid.particles.position.T - places[row])
                tell_liquid_within(_label(key), self._solids[key], liquid, spacing)

    def _placed(self, key: LinkKey, position: Array, volume: Array) -> PlacedWalls:
        """Return a link's wall particles at its present place in the client."""
        place, orientation = link_pose(self._client, *key)
        return PlacedWalls(Rotation.from_quat(orientation).apply(position) + place, volume)

    def _require_client(self) -> None:
        if isinstance(self._client, bool) or not isinstance(self._client, int | np.integer):
            raise TypeError(
                f"client is {self._client!r}, allowed: what pybullet.connect returned, of a BulletClient its _client"
            )
        if not pybullet.isConnected(self._client):
            raise ValueError(
                f"client {self._client} is not connected, allowed: what pybullet.connect returned, until it is disconnected"
            )

    def _require_attached(self) -> None:
        if self._detached:
            raise RuntimeError("the fluid is detached from this world, allowed: to make another one with attach_fluid")

    def _require_only_mover(self) -> None:
        strange = set(self.fluid.moving_boundaries) - set(self._handles.values())
        if strange:
            raise ValueError(
                f"boundaries {sorted(strange)} of the fluid are moved by somebody else, allowed: bodies of one world, which detach() ends"
            )

    def _refuse_cut_that_moved(self, system: LinkSystem) -> None:
        """Refuse a move of a body larger than the domain, which was sampled only where it lay; ValueError."""
        for row, key in enumerate(system.keys):
            if key in self._handles and key[0] in self._cut and not np.allclose(system.pose[row], self._cut[key[0]]):
                raise ValueError(
                    f"body {key[0]} is larger than the fluid's domain and was sampled where it lay, allowed: to move it after "
                    f"remove_body({key[0]}), and add it again"
                )

    def _require_alone(self) -> None:
        """Warn once if another world steps the client's bodies in turn."""
        last = _LAST_STEPPED.get(self._client)
        if self._has_stepped and last is not self and last is not None and not self._is_told:
            self._is_told = True
            warnings.warn(
                f"client {self._client} is stepped by another fluid's world in turn: each step moves all bodies on, so that they run ahead "
                "of both fluids; phases of one Fluid meet, fluids of one client do not",
                stacklevel=3,
            )
        _LAST_STEPPED[self._client], self._has_stepped = self, True

    def _sampled(self, key: LinkKey, mesh: trimesh.Trimesh) -> SurfaceSampling | None:
        """Sample a link's solid; None, with a warning, if it is too small for the fluid."""
        try:
            return self._sampling(key, mesh)
        except UnresolvedSolidError as cause:
            warnings.warn(f"{_label(key)} does not meet the fluid: {cause}", stacklevel=4)
        except ValueError as cause:
            raise ValueError(f"{_label(key)} cannot be sampled: {cause}") from cause
        return None

    def _sampling(self, key: LinkKey, mesh: trimesh.Trimesh) -> SurfaceSampling:
        """Sample a link's solid; links and bodies of one shape share the sampling."""
        spacing, within = self.fluid.config.particle_spacing, self._reach(key, mesh)
        if within is not None:
            if (within[0] > mesh.bounds[1]).any() or (within[1] < mesh.bounds[0]).any():
                raise ValueError(
                    f"it lies where the fluid does not come, allowed: in reach of its domain, {self.fluid.config.lower} to "
                    f"{self.fluid.config.upper} m"
                )
            return sample_surface(mesh, spacing, minimum_thickness=HELD * spacing, within=within)
        least = HELD * spacing if self._is_held(key) else spacing
        shape = (mesh.vertices.tobytes(), mesh.faces.tobytes(), least)
        if shape not in self._samplings:
            self._samplings[shape] = sample_surface(mesh, spacing, minimum_thickness=least)
        return self._samplings[shape]

    def _reach(self, key: LinkKey, mesh: trimesh.Trimesh) -> Box | None:
        """Return the box, along the body's axes, in which a held base larger than the domain is sampled; None for any other link."""
        config, body = self.fluid.config, key[0]
        lower, upper = np.array(config.lower), np.array(config.upper)
        if not self._is_held(key) or np.max(mesh.extents) <= np.linalg.norm(upper - lower):
            return None
        if any(config.periodic):
            raise ValueError(
                f"body {body} is larger than the fluid's domain, which repeats, allowed: a domain that does not, or a tank's floor in "
                "the body's place"
            )
        position, orientation = pybullet.getBasePositionAndOrientation(body, physicsClientId=self._client)
        self._cut[body] = np.array([*position, *orientation])
        corners = np.array(list(itertools.product(*zip(lower, upper, strict=True)))) - position
        own = Rotation.from_quat(orientation).inv().apply(corners)
        margin = 2.0 * config.support_radius
        return own.min(axis=0) - margin, own.max(axis=0) + margin

    def _is_held(self, key: LinkKey) -> bool:
        """Tell whether a link is a base without mass, which the fluid does not move."""
        return key[1] < 0 and pybullet.getDynamicsInfo(*key, physicsClientId=self._client)[0] == 0.0

    def _tell_inertia(self, key: LinkKey, mesh: trimesh.Trimesh) -> None:
        information = pybullet.getDynamicsInfo(*key, physicsClientId=self._client)
        if information[0] > 0.0:
            tell_inertia(*key, mesh, float(information[0]), np.array(information[2]))


_WORLDS: weakref.WeakKeyDictionary[Fluid, weakref.WeakSet[FluidWorld]] = weakref.WeakKeyDictionary()
_LAST_STEPPED: weakref.WeakValueDictionary[int, FluidWorld] = weakref.WeakValueDictionary()  # by client


def _label(key: LinkKey) -> str:
    return f"body {key[0]}, link {key[1]}"


def attach_fluid(
    client: int, fluid: Fluid, bodies: Iterable[int], *, no_slip: bool = False, contact_angle: float = RIGHT_ANGLE
) -> FluidWorld:
    """Put `fluid` into the pybullet client `client`, to meet the bodies with these unique ids.

    Place the fluid's particles around the bodies: a warning tells of particles inside a body, and they are not removed. A held body larger
    than the fluid's domain, such as the ground of plane.urdf, is sampled where the fluid can reach it. no_slip: viscous liquids stick to
    the bodies; contact_angle [deg]: see `FluidWorld.add_body`. Raises TypeError for bodies that are no collection of ids,
    and the errors of `FluidWorld` and `FluidWorld.add_body`; the fluid is then left without these bodies.
    """
    if not isinstance(bodies, Iterable):
        raise TypeError(f"bodies is {bodies!r}, allowed: several unique ids, [{bodies!r}] for one body")
    world = FluidWorld(client, fluid)
    try:
        for body in bodies:
            world.add_body(body, no_slip=no_slip, contact_angle=contact_angle)
    except Exception:
        world.detach()  # the fluid is as it was, to be attached anew
        raise
    return world
