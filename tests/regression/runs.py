"""The recorded runs: every shipped scenario, two bodies in waves, the paper's scheme, and a pybullet world with the plugin.

Each run is small and short, on one thread. It covers what a shipped scenario alone would not: liquid that sleeps, thick liquid
between no-slip walls, a plane, and accounts of energy and momentum.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pybullet
import pybullet_data

from coupling.bullet.plugin import attach_fluid
from coupling.master.observer_dispatch import Observer
from oilsim import Fluid, FluidConfig, Phase, block, tank_walls
from recordings.model.frame import Frame
from scenarios.running.assembly import Assembly, build
from scenarios.running.checkpoints import run_state_hash
from scenarios.running.summary import SummaryObserver
from scenarios.spec.load import load_scenario

SUMMARY_KEYS = {
    "format", "scenario", "overrides", "versions", "ended", "simulated_s", "wall_s", "real_time_factor", "steps", "step_ms",
    "stage_ms", "particles", "bodies", "skimmers", "left_the_tank", "density_error", "iterations", "exchange", "momentum_residual",
    "energy_residual", "budget", "oil_m3", "scores", "probes", "state_hash", "events",
}  # fmt: skip
OIL_KEYS = {
    "spilled", "afloat", "contained", "lost", "lost_modelled", "recontained", "recovered", "stranded", "evaporated",
    "left_the_domain", "resolved",
}  # fmt: skip
HERE = Path(__file__).parent
STEP = 0.01  # s
OWN = ("two-bodies-in-waves", "thick-oil-in-a-plane")  # scenario files beside this one

# name: scenario, spacing [m], communication steps, other settings
SCENARIOS: dict[str, tuple[str, float, int, tuple[str, ...]]] = {
    "calm-spread": ("calm-spread", 0.1, 30, ()),
    "dam-break": ("dam-break", 0.03, 30, ("run.budget=true",)),
    "floating-box": ("floating-box", 0.1, 30, ()),
    "rock-coating": ("rock-coating", 0.025, 80, ()),
    "still-column": ("still-column", 0.06, 30, ()),
    "two-layer": ("two-layer", 0.08, 30, ()),
    "drop-in-air": ("drop-in-air", 0.00125, 4, ()),
    "sweep-200m": ("sweep-200m", 0.25, 8, ()),
    "harbour-1km": ("harbour-1km", 0.25, 4, ()),
    "j-sweep-skimmer": ("j-sweep-skimmer", 0.25, 4, ("injects.stops.at=0.02", "injects.stops.spread=0.0")),
    "anchored-containment": ("anchored-containment", 0.25, 4, ("injects.drags.at=0.02", "injects.drags.spread=0.0")),
    "inlet-exclusion": ("inlet-exclusion", 0.25, 4, ()),
    "river-diversion-cascade": ("river-diversion-cascade", 0.25, 4, ()),
    "deploy-and-connect": ("deploy-and-connect", 0.25, 4, ()),
    "deploy-from-reel": ("deploy-from-reel", 0.25, 4, ("booms.main.reel.paid_out=58.0",)),
    "v-sweep": ("v-sweep", 0.25, 4, ()),
    "fast-sweep": ("fast-sweep", 0.25, 4, ()),
    "open-apex-follow": ("open-apex-follow", 0.25, 4, ()),
    "launch-from-slip": ("launch-from-slip", 0.25, 4, ()),
    "shore-seal": ("shore-seal", 0.25, 4, ()),
    "tow-speed-ramp": ("tow-speed-ramp", 0.125, 12, ()),
    "tow-speed-trial": ("tow-speed-trial", 0.25, 8, ()),
    "u-sweep": ("u-sweep", 0.12, 12, ("tow.start=0.05",)),
    "wave-flume": ("wave-flume", 0.08, 20, ()),
    "wind-drift": ("wind-drift", 0.12, 30, ()),
    "two-bodies-in-waves": ("two-bodies-in-waves", 0.08, 30, ()),
    "thick-oil-in-a-plane": ("thick-oil-in-a-plane", 0.04, 20, ()),
    "sleeping": ("floating-box", 0.1, 60, ("fluid.sleep_speed=0.05",)),
    "paper-calm-spread": ("calm-spread", 0.15, 15, ("fluid.scheme=paper",)),
    "paper-two-layer": ("two-layer", 0.1, 15, ("fluid.scheme=paper",)),
}


def run_scenario_case(name: str) -> dict[str, Any]:
    """Run a case of SCENARIOS to its end."""
    source, spacing, steps, more = SCENARIOS[name]
    settings = [
        f"fluid.particle_spacing={spacing}", f"run.communication_step={STEP}", f"run.duration={steps * STEP}", "run.threads=1"
    ]  # fmt: skip
    file = str(HERE / f"{source}.toml") if source in OWN else source
    assembly = build(load_scenario(file, overrides=[*settings, *more]).scenario)
    summary, last = SummaryObserver(assembly), Last()
    simulation = assembly.co_simulation([summary, last])
    simulation.initialize()
    for _ in range(steps):
        simulation.step()
    assert last.frame is not None
    hold_to_what_can_be(assembly, last.frame, summary, steps)
    state = run_state_hash(simulation, assembly)
    poses = [] if assembly.world is None else [assembly.world.pose(one) for one in assembly.world.body_names]
    result = _figures(assembly.fluid, poses) | {"state": state}
    simulation.terminate("completed")
    return result


class Last(Observer):
    """Keeps the last frame."""

    frame: Frame | None = None

    def step_completed(self, frame: Frame) -> None:
        """Keep it in place of the one before."""
        self.frame = frame


def hold_to_what_can_be(assembly: Assembly, frame: Frame, summary: SummaryObserver, steps: int) -> None:
    """Check that every particle is where one can be, every body is shown, and the summary is JSON with its keys."""
    assert frame.index == steps
    for phase in frame.phases.values():
        assert np.isfinite(phase.position).all()
        assert (np.diff(phase.id.astype(np.int64)) > 0).all()
    assert set(frame.bodies) == set(assembly.body_names)
    assert assembly.description.particle_volume == assembly.fluid.config.rest_volume
    result = json.loads(json.dumps(summary.summary(frame.time), allow_nan=False))
    assert set(result) == SUMMARY_KEYS
    assert result["steps"] == steps
    assert set(result["particles"]) == {*assembly.scenario.phases, "boundary"}
    assert set(result["oil_m3"]) == OIL_KEYS
    assert set(result["step_ms"]) == {"median", "p95", "max"}


def run_plugin_world() -> dict[str, Any]:
    """A light box and a two-link swinging arm in a pybullet client, in water over the ground of plane.urdf."""
    client = pybullet.connect(pybullet.DIRECT)
    pybullet.setGravity(0.0, 0.0, -9.81, physicsClientId=client)
    pybullet.setTimeStep(1.0 / 120.0, physicsClientId=client)
    plane = str(Path(pybullet_data.getDataPath()) / "plane.urdf")
    bodies = [pybullet.loadURDF(plane, physicsClientId=client), _box(client), _arm(client)]
    water = FluidConfig(
        particle_spacing=0.06,
        phases=(Phase(name="water", rest_density=1000.0),),
        lower=(-1.0, -1.0, -0.5),
        upper=(1.0, 1.0, 2.0),
    )
    fluid = Fluid(water, threads=1)
    fluid.add_boundary(tank_walls((-0.48, -0.48, 0.0), (0.48, 0.48, 1.5), 0.06, sides=("-x", "+x", "-y", "+y")))
    fluid.add_particles(block((-0.48, -0.48, 0.0), (0.48, 0.48, 0.3), 0.06), phase="water")
    world = attach_fluid(client, fluid, bodies)
    for _ in range(40):
        world.step()
    places = [np.hstack(pybullet.getBasePositionAndOrientation(body, physicsClientId=client)) for body in bodies]
    places.append(np.array(pybullet.getLinkState(bodies[2], 0, physicsClientId=client)[0]))
    result = _figures(fluid, places)
    fluid.close()
    pybullet.disconnect(client)
    return result


def _box(client: int) -> int:
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.12] * 3, physicsClientId=client)
    return pybullet.createMultiBody(3.0, shape, basePosition=[-0.2, -0.2, 0.45], physicsClientId=client)


def _arm(client: int) -> int:
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.15, 0.1, 0.07], physicsClientId=client)
    return pybullet.createMultiBody(
        4.0, shape, basePosition=[0.0, 0.2, 0.4], linkMasses=[4.0], linkCollisionShapeIndices=[shape], linkVisualShapeIndices=[-1],
        linkPositions=[[0.32, 0.0, 0.0]], linkOrientations=[[0, 0, 0, 1]], linkInertialFramePositions=[[0, 0, 0]],
        linkInertialFrameOrientations=[[0, 0, 0, 1]], linkParentIndices=[0], linkJointTypes=[pybullet.JOINT_REVOLUTE],
        linkJointAxis=[[0, 1, 0]], physicsClientId=client,
    )  # fmt: skip


def _figures(fluid: Fluid, poses: list[np.ndarray]) -> dict[str, Any]:
    """Hash of what moves, bit for bit, and a few sums that other machines must come near to."""
    state, digest = fluid.particles, hashlib.sha256()
    for values in (state.position, state.velocity, state.pressure_impulse, state.phase, state.id, *poses):
        digest.update(np.ascontiguousarray(values).tobytes())
    energy = fluid.energy()
    return {
        "motion": digest.hexdigest(),
        "particles": fluid.particle_count,
        "kinetic_j": float(energy.kinetic),
        "potential_j": float(energy.potential),
        "bodies_m": [round(float(x), 6) for pose in poses for x in np.ravel(pose)[:3]],
    }


CASES: dict[str, Callable[[], dict[str, Any]]] = {
    **{name: (lambda name=name: run_scenario_case(name)) for name in SCENARIOS},
    "plugin-world": run_plugin_world,
}
