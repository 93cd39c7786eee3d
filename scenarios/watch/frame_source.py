"""The frame that observers are shown at each communication point; making one reads the run and changes nothing."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.master.observer_dispatch import CommunicationPoint
from coupling.master.participant import Causality, Participant
from coupling.multibody.lines import ElasticLine
from coupling.multibody.mooring_leg import MooringLeg
from oilsim import Fluid
from oilsim.backend.arrays import Array
from recordings.model.entity_paths import BOOM
from recordings.model.frame import (
    BodyFrame,
    Frame,
    PhaseFrame,
    PhasesOnRequest,
)
from recordings.model.surface import FilmFrame, SurfaceFrame
from scenarios.schema.liquid import Tank
from scenarios.schema.run_settings import PressureProbe, Probe, VelocityProbe, WaveGauge
from scenarios.setup.afloat.boom_lines import paid_out, reel_name
from scenarios.setup.afloat.fleet import Fleet
from scenarios.setup.afloat.moorings import tie_name
from scenarios.setup.run_description import describe_windows
from scenarios.setup.simulators import Simulators
from scenarios.watch.run_accounts import RunAccounts
from scenarios.watch.sea_surface import SeaSurface
from scenarios.watch.slick_oil import phase_of
from scenarios.watch.water_surface import sea_with_windows, tank_surface

SPATIAL = 3  # [1] dimensions of a run that is no slice
Reading = Callable[[], Mapping[str, float]]
BodyReading = Callable[[str], tuple[Array, Array]]  # a body's pose (7,) and the fluid's wrench on it (6,)

AXES = ("x", "y", "z")


def _pulls(fleet: Fleet) -> dict[str, tuple[str, ...]]:
    """Return, for each boom segment and tow line, the joints at its ends."""
    found: dict[str, tuple[str, ...]] = {}
    for joint in fleet.joints:
        for body in (joint.body_a, joint.body_b):
            if body is not None and body.startswith(f"{BOOM}/"):
                found[body] = (*found.get(body, ()), joint.name)
    return found


class FrameReader:
    """Reads the frame of a communication point: figures at once, bodies and particles only for whoever asks.

    Reading changes nothing: the accounts have been advanced before, and a frame may be read twice or never.
    """

    def __init__(self, simulators: Simulators, accounts: RunAccounts, fmus: Sequence[Participant] = ()) -> None:
        """Read frames of the simulators, of the accounts, and of the outputs of `fmus`."""
        self._simulators = simulators
        self._pulls = _pulls(simulators.fleet)
        self._accounts = accounts
        self._fmus = fmus
        self._windows = describe_windows(simulators)
        self._sea_surface = SeaSurface()
        scenario = simulators.scenario
        by_formulas = () if simulators.world is None else simulators.world.loaded_names
        self._loaded = {*simulators.coupled, *by_formulas}
        self._probes = _probe_readings(
            scenario.probes, simulators.fluid, self._pose_and_wrench, scenario.domain.lower[2]
        )

    def __call__(self, point: CommunicationPoint) -> Frame:
        """Return the frame at a communication point; bodies and particles must be asked for before the run goes on."""
        accounts = self._accounts
        scalars = accounts.figures.series() | dict(self._probes()) | accounts.scoring.series()
        scalars |= self._middles(point.time) | accounts.coupling.series() | self._moorings() | self._fmu_outputs()
        return Frame(
            index=point.index,
            time=point.time,
            bodies=self._bodies,
            scalars=scalars,
            read_phases=lambda: self._phases(point.time),
            read_surface=lambda: self._surface(point.time),
            read_film=self._film,
        )

    def _surface(self, time: float) -> SurfaceFrame | None:
        """Return the surface of the water at `time` [s]; None without water, in a slice, and in a run of bodies at sea without a world."""
        simulators = self._simulators
        for tank in simulators.scenario.tanks:
            return self._tank_surface(tank, time)
        world, sea = simulators.world, simulators.sea.now
        if world is None:
            return None
        places = world.poses([solid.name for solid in simulators.solids])[:, :2]
        parcels = [slick.slick.parcels for slick in simulators.slicks]
        oil = [one.position[one.there()] for one in parcels]
        around = np.concatenate([places, *oil])
        windows = simulators.windows
        if not windows or windows[0].settings.dimension < SPATIAL:
            return self._sea_surface.frame(sea, time, around)
        return sea_with_windows(sea, time, around, windows)

    def _tank_surface(self, tank: Tank, time: float) -> SurfaceFrame | None:
        """Return the surface of the particles of all liquids but oil; None without any, in a slice, and where gravity is not downwards."""
        simulators, scenario = self._simulators, self._simulators.scenario
        is_down = scenario.fluid.gravity[2] < 0.0 and not any(scenario.fluid.gravity[:2])
        waters = [name for name, phase in scenario.phases.items() if not phase.is_oil]
        if not waters or not is_down or simulators.fluid.config.dimension < SPATIAL:
            return None
        places = np.concatenate([simulators.positions(name, time) for name in waters])
        return tank_surface(places, scenario.fluid.particle_spacing, tank.lower, tank.upper)

    def _film(self, surface: SurfaceFrame) -> FilmFrame | None:
        films = (self._sea_surface.film(surface, one.slick) for one in self._simulators.slicks)
        return next(films, None)

    def _middles(self, time: float) -> dict[str, float]:
        """Return the places [m] of the windows' middles at `time` [s], by the names of their series; empty without one."""
        series = dict[str, float]()
        for told, window in zip(self._windows, self._simulators.windows, strict=True):
            series |= dict(zip(told.middle_series, window.middle(time).tolist(), strict=True))
        return series

    def _moorings(self) -> dict[str, float]:
        """Return the tension [N] of each tie, reel and mooring leg, how far [m] its anchor has dragged, and where [m] it is."""
        world, series = self._simulators.world, dict[str, float]()
        if world is not None:
            ties = [tie_name(name) for name in self._simulators.scenario.ties]
            series |= {f"{tie}/tension": world.tension(tie) for tie in ties}
            series |= self._waiting_ties(world) | self._reels(world)
        for leg in self._simulators.fleet.legs if world is not None else ():
            assert world is not None
            line = world.lines[leg.name]
            assert isinstance(line, MooringLeg)
            series |= {f"{leg.name}/tension": line.tension, f"{leg.name}/dragged": line.dragged}
            series |= {f"{leg.name}/anchor/{axis}": float(line.place[row]) for row, axis in enumerate("xy")}
        return series

    def _waiting_ties(self, world: RigidBodyWorld) -> dict[str, float]:
        """Return, for each tie that waits to be made fast, the distance [m] of its ends, and whether it is fast, 0 or 1."""
        series = dict[str, float]()
        for tie in (tie_name(name) for name, one in self._simulators.scenario.ties.items() if one.waits):
            line = world.lines[tie]
            assert isinstance(line, ElasticLine)
            series |= {f"{tie}/distance": world.line_distance(tie), f"{tie}/made_fast": float(line.made_fast)}
        return series

    def _reels(self, world: RigidBodyWorld) -> dict[str, float]:
        """Return the tension [N] at each reel, and the length [m] of boom that it has paid out."""
        series = dict[str, float]()
        for name, settings in self._simulators.scenario.booms.items():
            mouth = settings.ends[0]
            if settings.reel is not None and not isinstance(mouth, str):
                reel, layout = reel_name(name), self._simulators.fleet.booms[name]
                series |= {
                    f"{reel}/tension": world.tension(reel),
                    f"{reel}/paid_out": paid_out(name, layout, mouth, world.lines),
                }
        return series

    def _fmu_outputs(self) -> dict[str, float]:
        """Return the outputs of each FMU, named ``fmus/winch/paid_out``; of an array, each element, once."""
        outputs: dict[str, float] = {}
        for fmu in self._fmus:
            arrays = {name for name, variable in fmu.variables.items() if math.prod(variable.shape) > 1}
            for name, variable in fmu.variables.items():
                if variable.causality is Causality.OUTPUT and name.rpartition("[")[0] not in arrays:
                    values = fmu.get(name).ravel()
                    place = f"{fmu.name.replace('.', '/', 1)}/{name}"
                    outputs |= {f"{place}/{i}" if len(values) > 1 else place: float(v) for i, v in enumerate(values)}
        return outputs

    def _phases(self, time: float) -> Mapping[str, PhaseFrame]:
        simulators = self._simulators
        readers: dict[str, Callable[[], PhaseFrame]] = {
            name: partial(self._particles, name, time) for name in simulators.scenario.phases
        }
        for slick in simulators.slicks:
            oils = [name for name, phase in simulators.scenario.phases.items() if phase.is_oil]
            readers |= {
                name: partial(phase_of, slick, number, simulators.sea.now, time) for number, name in enumerate(oils)
            }
        return PhasesOnRequest(readers)

    def _particles(self, phase: str, time: float) -> PhaseFrame:
        simulators = self._simulators
        fate = self._accounts.scoring.fates(phase)
        return PhaseFrame(simulators.positions(phase, time), simulators.fluid.phase_ids(phase), fate=fate)

    def _bodies(self) -> Mapping[str, BodyFrame]:
        simulators = self._simulators
        world, solids = simulators.world, simulators.solids
        if world is None:
            return {
                one.name: BodyFrame(position=one.placed.position, orientation=one.placed.orientation) for one in solids
            }
        names = [solid.name for solid in solids]
        wrenches = np.array([simulators.wrench(name) for name in names]).reshape(-1, 6)
        motions = np.hstack([world.poses(names), world.twists(names), wrenches])
        pulls = (max(map(world.tension, self._pulls.get(name, ())), default=math.nan) for name in names)
        held = self._accounts.scoring.held_speeds()
        speeds = (held.get(name, math.nan) for name in names)
        return {name: BodyFrame.of(*one) for name, *one in zip(names, motions, pulls, speeds, strict=True)}

    def _pose_and_wrench(self, name: str) -> tuple[Array, Array]:
        world = self._simulators.world
        assert world is not None  # a probed body is coupled
        return world.pose(name), self._simulators.wrench(name) if name in self._loaded else np.zeros(0)


def _probe_readings(probes: Mapping[str, Probe], fluid: Fluid, body: BodyReading, floor: float) -> Reading:
    """Return a reading of all probes of a scenario; its series are named ``probes/<name>`` or ``probes/<name>/<component>``.

    floor [m] of the tank, which a wave gauge reads where it is dry.
    """
    readings = [_reading(f"probes/{name}", probe, fluid, body, floor) for name, probe in probes.items()]
    return lambda: {name: value for reading in readings for name, value in reading().items()}


def _reading(path: str, probe: Probe, fluid: Fluid, body: BodyReading, floor: float) -> Reading:
    if isinstance(probe, PressureProbe):
        points = np.array([probe.point])
        return lambda: {path: float(fluid.pressure_at(points)[0])}
    if isinstance(probe, WaveGauge):
        places = np.array([probe.point])
        return lambda: {path: max(floor, float(fluid.surface_height_at(places)[0]))}
    if isinstance(probe, VelocityProbe):
        points = np.array([probe.point])
        return lambda: _components(path, AXES, fluid.velocity_at(points)[0])
    name = probe.body
    return lambda: _body_components(path, *body(name))


def _body_components(path: str, pose: Array, wrench: Array) -> dict[str, float]:
    """Return position [m], roll, pitch and yaw [deg], force [N] and torque [N m]; `wrench` is empty of a body that nothing loads."""
    angles = Rotation.from_quat(pose[3:]).as_euler("xyz", degrees=True)
    return (
        _components(path, AXES, pose[:3])
        | _components(path, ("roll_deg", "pitch_deg", "yaw_deg"), angles)
        | _components(path, [f"{what}_{axis}" for what in ("force", "torque") for axis in AXES][: len(wrench)], wrench)
    )


def _components(path: str, names: tuple[str, ...] | list[str], values: Array) -> dict[str, float]:
    return {f"{path}/{name}": float(value) for name, value in zip(names, values, strict=True)}
