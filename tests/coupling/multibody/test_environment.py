"""Bodies in a sea without particles: stable at a fiftieth of water's density, with the period and the work of theory, joints included."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh

from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.solids.bodies import mass_properties
from oilsim.loads.load_model import LoadModel, Part, Station
from oilsim.loads.morison import FloatingBodies
from tests.seas import steady_sea

RHO, G = 1000.0, 9.81
SIZE = np.array((2.0, 1.0, 0.5))  # wide enough not to capsize at any density
STEP = 0.02


def box_model(density=500.0, added=(0.0, 0.0, 0.0), drag=(0.0, 0.0, 0.0), damping=(0.0, 0.0, 0.0)) -> LoadModel:
    triangles = np.array(trimesh.creation.box(SIZE).triangles, dtype=np.float64)
    part = Part(
        triangles=triangles,
        added_mass=np.array(added),
        wave_damping=np.array(damping),
        design_volume=float(SIZE.prod()) * density / RHO,
    )
    ends = [
        Station(place=np.array((x, 0, 0)), drag_area=0.5 * np.array(drag), wind_area=np.zeros(3), half_height=0.25)
        for x in (-0.5, 0.5)
    ]
    return LoadModel(parts=(part,), stations=tuple(ends))


def afloat(model: LoadModel, density: float, heights, water=None, sub_step=STEP) -> RigidBodyWorld:
    """Boxes end to end along x, joined end to end, at heights [m] over the draft at which they float."""
    world = RigidBodyWorld(sub_step=sub_step)
    mesh = trimesh.creation.box(SIZE)
    level = SIZE[2] * (0.5 - density / RHO)  # of the centre over the water
    names = [f"box {n}" for n in range(len(heights))]
    for n, (name, height) in enumerate(zip(names, heights, strict=True)):
        world.add_body(
            name, mesh, mass_properties(mesh, density=density), (SIZE[0] * n, 0, level + height), friction=None
        )
    for n in range(1, len(names)):
        world.add_joint(f"joint {n}", names[n - 1], names[n], (SIZE[0] * (n - 0.5), 0, level))
    bodies = FloatingBodies([model] * len(names), water or steady_sea(density=RHO))
    world.set_environment(bodies, names)
    return world


@pytest.mark.parametrize(("density", "share"), [(20.0, 1.0), (20.0, 20.0), (500.0, 1.0)])
def test_heave_has_the_period_of_mass_and_added_mass(density, share):
    """omega^2 = rho g A / (m + a); symplectic Euler makes it cos(omega' h) = 1 - (omega h)^2 / 2. No swing grows in 1000 steps."""
    mass = density * SIZE.prod()
    added = share * mass
    world = afloat(box_model(density, added=(0, 0, added)), density, [-0.02 * density / RHO])
    level = SIZE[2] * (0.5 - density / RHO)
    heights = []
    for _ in range(1000):
        world.advance(STEP)
        heights.append(world.pose("box 0")[2] - level)
    world.close()
    heights = np.array(heights)
    ups = np.flatnonzero((heights[:-1] < 0) & (heights[1:] >= 0))
    crossings = ups + heights[ups] / (heights[ups] - heights[ups + 1])
    period = STEP * np.diff(crossings).mean()
    swing = STEP * math.sqrt(RHO * G * SIZE[0] * SIZE[1] / (mass + added))
    assert period == pytest.approx(2 * math.pi * STEP / math.acos(1 - swing**2 / 2), rel=0.01)
    assert 0.5 * np.abs(heights[:200]).max() < np.abs(heights[-200:]).max() < 1.001 * np.abs(heights[:200]).max()


def test_still_water_makes_no_energy():
    """Kinetic and potential energy, with that of the water carried along and displaced, never exceeds its start in 1000 steps."""
    added = RHO * SIZE.prod()
    world = afloat(box_model(20.0, added=(0, added, added), drag=(0.1, 1.0, 1.0)), 20.0, [0.008])
    energies = []
    for _ in range(1000):
        world.advance(STEP)
        twist, wet = world.twist("box 0"), max(0.0, 0.25 - world.pose("box 0")[2])
        carried = added * min(1.0, wet / 0.01)  # its draft at rest is 1 cm
        lifted = 0.5 * RHO * G * SIZE[0] * SIZE[1] * wet**2
        energies.append(world.energy() + 0.5 * carried * (twist[1:3] ** 2).sum() + lifted)
    world.close()
    energies = np.array(energies)
    swing = energies[0] - energies[-1]
    assert swing > 0.0
    assert energies.max() <= energies[0] + 0.1 * swing


def test_light_chain_with_heavy_added_mass_is_stable_and_its_joints_hold():
    """Five boxes of a fiftieth of water's density in a current of 1 m/s, held at one end: they stream, and the tow force is their drag."""
    drag = (0.2, 2.0, 1.0)
    model = box_model(20.0, added=(0, 1000.0, 1000.0), drag=drag, damping=(0, 0, 200.0))
    world = afloat(model, 20.0, [0.0] * 5, steady_sea(density=RHO, current=(1.0, 0.0)))
    world.add_joint("mooring", "box 0", None, (-1.0, 0, SIZE[2] * 0.48))
    tensions = []
    for _ in range(1500):
        world.advance(STEP)
        tensions.append(world.tension("mooring"))
    gaps = [
        np.linalg.norm(world.pose(f"box {n}")[:3] + np.array((2.0, 0, 0)) - world.pose(f"box {n + 1}")[:3])
        for n in range(4)
    ]
    sea = sum(world.sea_wrench(f"box {n}")[0] for n in range(5))
    world.close()
    wetted = 0.5 + 0.5 * (0.0 - SIZE[2] * 0.48) / 0.25  # share of a station's height
    expected = 5 * 0.5 * RHO * drag[0] * wetted
    assert np.mean(tensions[-500:]) == pytest.approx(expected, rel=0.02)
    assert sea == pytest.approx(expected, rel=0.05)
    assert max(gaps) < 2e-3


def test_restored_world_goes_on_bit_for_bit():
    model = box_model(20.0, added=(0, 500.0, 500.0), drag=(0.2, 2.0, 1.0))
    worlds = [afloat(model, 20.0, [0.02, 0.0], steady_sea(density=RHO, current=(0.3, 0.2))) for _ in range(2)]
    for _ in range(50):
        worlds[0].advance(STEP)
    worlds[1].restore_state(worlds[0].save_state())
    assert np.array_equal(worlds[0].coupled_inverse_mass(["box 0"]), worlds[1].coupled_inverse_mass(["box 0"]))
    for world in worlds:
        for _ in range(20):
            world.advance(STEP)
    poses = [np.concatenate([world.pose(name) for name in world.body_names]) for world in worlds]
    for world in worlds:
        world.close()
    assert np.array_equal(*poses)


def test_environment_loads_free_bodies_only():
    world = RigidBodyWorld()
    mesh = trimesh.creation.box(SIZE)
    world.add_body("pier", mesh, mass_properties(mesh, density=500.0), motion="fixed")
    bodies = FloatingBodies([box_model()], steady_sea(density=RHO))
    with pytest.raises(ValueError, match="the environment loads 'pier', which is not free, allowed: free bodies"):
        world.set_environment(bodies, ["pier"])
    world.close()
