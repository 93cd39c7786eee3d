"""Scenes to begin with: a tank of water, a flume with a wave maker, and empty space.

Water for pybullet worlds, filled around the bodies that are in them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.bullet.assembly import MONOLITHIC, ExchangeOptions
from coupling.bullet.pybullet_import import pybullet
from coupling.bullet.shapes import link_mesh, link_pose
from coupling.master.co_simulation import CoSimulation
from coupling.multibody.prescribed_motion import OscillatingMotion, Vector
from coupling.solids.bodies import box
from coupling.solids.signed_distance import SignedDistance
from coupling.testkit.readings import Basin
from coupling.testkit.scene import CLEARANCE, STEP, Scene
from oilsim import Fluid, FluidConfig, Phase, block, tank_walls
from oilsim.fluid.checks import finite
from oilsim.sea.regular_waves import wave_number

WATER = Phase(name="water", rest_density=1000.0)
MARGIN = 4.0  # spacings of the domain beyond the walls
ROOM = 1.8  # height of a flume, in depths: a crest of the steepest wave reaches 0.8 depths over the level
PISTON = 4.0  # spacings: thickness of the piston
RAMP = 1.0  # periods in which the stroke of the piston grows
STROKES = 0.3  # largest amplitude of the stroke, in depths: theory is linear


def tank(
    *,
    size: Vector,
    depth: float,
    particle_spacing: float,
    phase: Phase = WATER,
    wet_length: float | None = None,
    sleep_speed: float = 0.0,
    threads: int | None = 1,
    exchange: ExchangeOptions = MONOLITHIC,
) -> TankScene:
    """Create a tank from the origin to `size` [m], open at the top, which fills to `depth` [m] around its bodies when the run begins.

    wet_length [m]: it fills from x = 0 to there only, behind a gate or a dam; the level is then unknown, and checks must state it.
    Regions that move at less than `sleep_speed` [m/s] fall asleep (`oilsim.step.sleeping_regions`). Raises ValueError for a size that is
    not above 0, and for a depth or wet_length that is not above 0 or exceeds the tank's.
    """
    if not (finite("tank: size", size, 3) > 0.0).all():
        raise ValueError(f"tank: size is {size} m, allowed: above 0")
    if not 0.0 < depth <= size[2]:
        raise ValueError(f"tank: depth is {depth} m, allowed: above 0, to its height of {size[2]} m")
    config = _config((0.0, 0.0, 0.0), size, particle_spacing, phase, sleep_speed=sleep_speed)
    if wet_length is not None and not 0.0 < wet_length <= size[0]:
        raise ValueError(f"tank: wet_length is {wet_length} m, allowed: above 0, to its length of {size[0]} m")
    return TankScene(config, (0.0, 0.0, 0.0), size, depth, wet_length=wet_length, threads=threads, exchange=exchange)


class TankScene(Scene):
    """A scene in a tank from `lower` to `upper` [m] that fills itself to `depth` [m] above z = 0 when its run begins, from x = 0 on."""

    def __init__(
        self,
        config: FluidConfig,
        lower: Vector,
        upper: Vector,
        depth: float,
        *,
        wet_length: float | None = None,
        threads: int | None = 1,
        exchange: ExchangeOptions = MONOLITHIC,
        name: str = "tank",
        basin: Basin | None = None,
    ) -> None:
        super().__init__(config, threads=threads, exchange=exchange, name=name)
        self._filled = (upper[0] if wet_length is None else wet_length, upper[1], depth)
        self.add_walls(lower, upper, basin=basin)
        if wet_length is not None:
            self._basin = None
        for corner, inward in ((lower, np.eye(3)), (upper, -np.eye(3)[:2])):
            for x, y, z in inward.tolist():
                self.world.add_half_space(corner, (x, y, z))

    def _coupled(self) -> CoSimulation:
        self.fill((0.0, 0.0, 0.0), self._filled, phase=self.fluid.config.phases[0].name)
        return super()._coupled()


def empty_space(
    *,
    size: Vector,
    particle_spacing: float,
    phases: tuple[Phase, ...] = (WATER,),
    communication_step: float = STEP,
    exchange: ExchangeOptions = MONOLITHIC,
) -> Scene:
    """Create a scene without walls and gravity in a domain of `size` [m] about the origin, in which momentum is constant.

    Angular momentum is constant up to rounding if fluid and bodies each make one step of their own in each `communication_step` [s]; a
    step of the bodies is 1/240 s or less. With more steps, the fluid and the moving body count one impulse at different places.
    """
    x, y, z = (0.5 * length for length in size)
    config = FluidConfig(
        particle_spacing=particle_spacing, phases=phases, lower=(-x, -y, -z), upper=(x, y, z), gravity=(0.0, 0.0, 0.0)
    )
    return Scene(config, communication_step=communication_step, exchange=exchange, name="empty space")


def flume(
    *,
    length: float,
    depth: float,
    particle_spacing: float,
    wave: tuple[float, float],
    width: float | None = None,
    exchange: ExchangeOptions = MONOLITHIC,
) -> TankScene:
    """Create a flume along x that ends in a wall, with a piston at x = 0 and gauges "near" and "far", one and two depths from it.

    length, depth [m]; wave: height [m] and period [s] of the wave. The piston's stroke follows from linear theory (`wave_maker`) and grows
    over a period; the body "piston" is the wave maker. width [m]: six spacings if it is None. The walls slip. Raises ValueError for
    lengths that are not above 0, a flume shorter than two depths, and a stroke that is longer than 0.6 depths.
    """
    height, period = finite("flume: wave", wave, 2).tolist()
    across = 6.0 * particle_spacing if width is None else width
    if not min(height, period, depth, across) > 0.0 or not length > 2.0 * depth:
        raise ValueError(
            f"flume: length is {length} m, depth {depth} m, width {across} m, wave ({height} m, {period} s), allowed: above 0, and a "
            "length above two depths"
        )
    amplitude, longest = 0.5 * height / wave_maker(period, depth), STROKES * depth
    if amplitude > longest:
        told = f"the stroke for a wave of {height} m and {period} s is {2 * amplitude:.3g} m"
        raise ValueError(f"flume: {told}, allowed: up to {2 * longest:.3g} m")
    back = math.ceil((amplitude + PISTON * particle_spacing) / particle_spacing + 1.0) * particle_spacing
    lower, upper = (-back, 0.0, 0.0), (length, across, ROOM * depth)
    config = _config(lower, upper, particle_spacing, WATER)
    scene = TankScene(
        config, lower, upper, depth, exchange=exchange, name="flume", basin=Basin(length * across, 0.0, ("piston",))
    )
    thickness, tall = PISTON * particle_spacing, ROOM * depth
    place = (-0.5 * thickness, 0.5 * across, 0.5 * tall)
    motion = OscillatingMotion(
        position=place, direction=(1.0, 0.0, 0.0), amplitude=amplitude, period=period, ramp_time=RAMP * period
    )
    plate = box((thickness, across, tall))
    scene.add_body("piston", plate, density=1000.0, position=place, motion=motion, touches=False)
    for gauge, away in (("near", 1.0), ("far", 2.0)):
        scene.add_gauge(gauge, (away * depth, 0.5 * across))
    return scene


def _config(lower: Vector, upper: Vector, spacing: float, phase: Phase, sleep_speed: float = 0.0) -> FluidConfig:
    """Describe the fluid of a tank with room for its walls."""
    margin = MARGIN * spacing
    return FluidConfig(
        particle_spacing=spacing,
        phases=(phase,),
        lower=(lower[0] - margin, lower[1] - margin, lower[2] - margin),
        upper=(upper[0] + margin, upper[1] + margin, upper[2] + margin),
        divergence_iterations=400,
        sleep_speed=sleep_speed,
    )


def wave_maker(period: float, depth: float) -> float:
    """Return wave height over stroke of a piston [1], 4 sinh^2 kh / (sinh 2kh + 2kh), with period [s] and depth h [m].

    Linear theory: Biesel and Suquet (1951), as in Dean and Dalrymple, Water Wave Mechanics, equation 6.25.
    """
    kh = wave_number(period, depth) * depth
    return 4.0 * math.sinh(kh) ** 2 / (math.sinh(2.0 * kh) + 2.0 * kh)


def pool(
    client: int, bodies: Iterable[int], *, lower: Vector, upper: Vector, depth: float, particle_spacing: float,
    phase: Phase = WATER, domain: tuple[Vector, Vector] | None = None,
) -> tuple[Fluid, Basin]:  # fmt: skip
    """Create a tank from `lower` to `upper` [m], open at the top and filled to `depth` [m] around the bodies of a pybullet client.

    The fluid runs on one thread. The tank's walls are the fluid's only, and do not stop bodies. Liquid beyond `domain`, the lower
    and upper corner [m], is lost; without it the domain ends 4 spacings beyond the tank, and one that reaches farther keeps what
    splashes out. Attach the fluid by `coupling.bullet.plugin.attach_fluid`. Returns the fluid, and the tank for `watch`. Raises ValueError
    for numbers that are not allowed.
    """
    if domain is None:
        margin = MARGIN * particle_spacing
        domain = (
            (lower[0] - margin, lower[1] - margin, lower[2] - margin),
            (upper[0] + margin, upper[1] + margin, upper[2] + margin),
        )
    config = FluidConfig(particle_spacing=particle_spacing, phases=(phase,), lower=domain[0], upper=domain[1])
    if not 0.0 < depth <= upper[2] - lower[2]:
        raise ValueError(f"pool: depth is {depth} m, allowed: above 0, to its height of {upper[2] - lower[2]:g} m")
    fluid = Fluid(config, threads=1)
    fluid.add_boundary(tank_walls(lower, upper, particle_spacing, sides=("-x", "+x", "-y", "+y", "-z")))
    points = block(lower, (upper[0], upper[1], lower[2] + depth), particle_spacing)
    for body in bodies:
        for link in range(-1, pybullet.getNumJoints(body, physicsClientId=client)):
            mesh = link_mesh(client, body, link)
            if mesh is not None:
                place, orientation = link_pose(client, body, link)
                own = Rotation.from_quat(orientation).inv().apply(points - place)
                points = points[np.asarray(SignedDistance(mesh).phi(own)) > CLEARANCE * particle_spacing * (1.0 - 1e-6)]
    fluid.add_particles(points, phase=phase.name)
    return fluid, Basin((upper[0] - lower[0]) * (upper[1] - lower[1]), lower[2])
