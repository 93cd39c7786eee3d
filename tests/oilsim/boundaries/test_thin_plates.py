"""Plates thinner than a particle hold water, whether they are held, move or float."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from coupling.solids.bodies import box
from coupling.solids.signed_distance import SignedDistance
from coupling.solids.surface_sampling import particles_of, sample_surface
from coupling.solids.thin_parts import HELD
from oilsim import block, tank_walls

SPACING = 0.1


@pytest.mark.parametrize("thickness", [0.3, 1.0, 1.1])
def test_no_particle_passes_a_held_plate_under_eight_spacings_of_water(make_fluid, thickness: float) -> None:
    upper, face = (2.4, 1.0, 1.6), 1.2 - 0.5 * thickness * SPACING
    fluid = make_fluid(lower=(0, 0, 0), upper=upper)
    fluid.add_boundary(tank_walls((0, 0, 0), upper, SPACING, sides=("-x", "+x", "-y", "+y", "-z")))
    plate = box((thickness * SPACING, 1.6, 2.4)).apply_translation((1.2, 0.5, 0.8))
    sampling = sample_surface(plate, SPACING, minimum_thickness=HELD * SPACING)
    fluid.add_boundary(particles_of("plate", sampling))
    fluid.add_particles(block((face - 1.1, 0, 0), (face, 1.0, 0.8), SPACING), phase="water")
    for _ in range(100):
        fluid.advance(0.01)
    assert np.max(fluid.particles.position[0]) < 1.2


@pytest.mark.parametrize(("thickness", "speed"), [(0.3, 0.0), (1.0, 0.0), (1.0, 1.5)])
def test_no_particle_passes_a_plate_that_moves_as_floating_ones_do(make_fluid, thickness: float, speed: float) -> None:
    """Water of eight spacings on one side; the plate of its own thickness stands, or swings to and fro by up to 0.15 spacings a step."""
    upper, face, x = (2.4, 1.0, 2.4), 1.2 - 0.5 * thickness * SPACING, 1.2
    fluid = make_fluid(lower=(0, 0, 0), upper=upper)
    fluid.add_boundary(tank_walls((0, 0, 0), upper, SPACING))
    sampling = sample_surface(box((thickness * SPACING, 1.6, 4.0)), SPACING)
    assert sampling.plate_normal is not None
    assert np.abs(sampling.plate_normal).max(axis=0) == pytest.approx([1.0, 0.0, 0.0])
    handle = fluid.add_boundary(particles_of("plate", sampling))
    fluid.add_particles(block((face - 1.1, 0, 0), (face, 1.0, 0.8), SPACING), phase="water")
    for n in range(100):
        velocity = (speed * math.sin(4.0 * math.pi * 0.01 * n), 0.0, 0.0)
        fluid.set_boundary_motion(handle, (x, 0.5, 1.2), (0, 0, 0, 1), velocity, (0, 0, 0))
        fluid.advance(0.01)
        x += 0.01 * velocity[0]
    assert fluid.particle_count == 880
    assert np.max(fluid.particles.position[0]) < x


def cup(thickness: float) -> trimesh.Trimesh:
    """A round cup of radius 0.6 m: curved walls that meet a floor."""
    half = 0.5 * thickness
    outer, inner = 0.6 + half, 0.6 - half
    section = [(0, -half), (outer, -half), (outer, 1.1), (inner, 1.1), (inner, half), (0, half)]
    mesh = trimesh.creation.revolve(section, sections=48)
    if mesh.volume < 0.0:
        mesh.invert()
    return mesh


def tray(thickness: float) -> trimesh.Trimesh:
    """A tray of 1.2 m with a partition: corners of two and three plates, and plates that end at others."""
    half, side = 0.5 * thickness, 0.6
    outer = bounded((-side - half, -side - half, -half), (side + half, side + half, 1.1))
    hollow = bounded((-side + half, -side + half, half), (side - half, side - half, 1.3))
    return outer.difference(hollow).union(bounded((-half, -side, 0.0), (half, side, 1.1)))


def trough(thickness: float) -> trimesh.Trimesh:
    """A trough of two plates that meet at 60 degrees, with plates at its ends."""
    slope, deep = math.tan(math.radians(30.0)), thickness  # along z, half the thickness of plates that stand so
    sections = ((-deep, 1.3, 1.2 + thickness), (deep, 1.5, 1.2 - thickness))
    outer, inner = (
        trimesh.Trimesh(
            [(x, y, z) for y in (-0.5 * length, 0.5 * length) for x, z in ((0, foot), (wide, top), (-wide, top))],
            [(0, 1, 2), (3, 5, 4), (0, 3, 4), (0, 4, 1), (1, 4, 5), (1, 5, 2), (2, 5, 3), (2, 3, 0)],
        )
        for foot, top, length in sections
        for wide in ((top - foot) * slope,)
    )
    return outer.difference(inner)


def bounded(lower: tuple[float, ...], upper: tuple[float, ...]) -> trimesh.Trimesh:
    return trimesh.creation.box(bounds=np.array([lower, upper]))


VESSELS = {
    "cup": (cup, lambda x, y, z: (np.hypot(x, y) < 0.6) & (z > 0.0)),
    "half a tray": (tray, lambda x, y, z: (x < 0.0) & (x > -0.6) & (np.abs(y) < 0.6) & (z > 0.0)),
    "trough": (trough, lambda x, y, z: (np.abs(x) < z * math.tan(math.radians(30.0))) & (np.abs(y) < 0.6)),
}


@pytest.mark.parametrize(
    ("vessel", "thickness", "speed"),
    [("cup", 1.0, 0.0), ("cup", 0.3, 0.5), ("half a tray", 0.3, 0.0), ("half a tray", 1.0, 0.5), ("trough", 1.0, 0.0)],
)
def test_no_particle_leaves_a_vessel_of_thin_plates(make_fluid, vessel: str, thickness: float, speed: float) -> None:
    """Filled eight to nine spacings deep, and held or swinging as bodies that answer to the water are: through wall, corner and foot."""
    shape, within = VESSELS[vessel]
    mesh = shape(thickness * SPACING)
    fluid = make_fluid(lower=(-1.8, -1.8, -1.0), upper=(1.8, 1.8, 2.4))
    handle = fluid.add_boundary(particles_of("vessel", sample_surface(mesh, SPACING)))
    points = block((-1.19, -1.187, 0.0), (1.21, 1.213, 0.9), SPACING)
    clear = SignedDistance(mesh).phi(points) > 0.4 * SPACING
    fluid.add_particles(points[clear & within(*points.T)], phase="water")
    count, x = fluid.particle_count, 0.0
    for n in range(100):
        velocity = (speed * math.sin(4.0 * math.pi * 0.01 * n), 0.0, 0.0)
        fluid.set_boundary_motion(handle, (x, 0, 0), (0, 0, 0, 1), velocity, (0, 0, 0))
        fluid.advance(0.01)
        x += 0.01 * velocity[0]
    place = fluid.particles.position - np.array([[x], [0.0], [0.0]])
    assert fluid.particle_count == count > 250
    assert within(*place).all()


@pytest.mark.parametrize("speed", [0.5, 1.5])
def test_no_particle_leaves_a_thin_box_that_is_shaken_and_turned(make_fluid, speed: float) -> None:
    """A closed box of 1 m, two thirds full, turns at up to 4.6 rad/s about all axes: walls come round while liquid flies straight on."""
    outer, inner = (0.5 + side * 0.15 * SPACING for side in (1.0, -1.0))
    mesh = bounded((-outer,) * 3, (outer,) * 3).difference(bounded((-inner,) * 3, (inner,) * 3))
    fluid = make_fluid(lower=(-1.8,) * 3, upper=(1.8,) * 3)
    handle = fluid.add_boundary(particles_of("box", sample_surface(mesh, SPACING)))
    fluid.add_particles(block((-0.45,) * 3, (0.45, 0.45, 0.25), SPACING), phase="water")
    count, place, turn = fluid.particle_count, np.zeros(3), Rotation.identity()
    for n in range(100):
        t = 0.01 * math.pi * n
        velocity = speed * np.array([math.sin(6.0 * t), 0.5 * math.sin(4.0 * t), 0.7 * math.sin(5.0 * t)])
        spin = 3.0 * np.array([math.cos(5.0 * t), math.sin(3.0 * t), 0.6])
        fluid.set_boundary_motion(handle, tuple(place), tuple(turn.as_quat()), tuple(velocity), tuple(spin))
        fluid.advance(0.01)
        place, turn = place + 0.01 * velocity, Rotation.from_rotvec(0.01 * spin) * turn
    own = turn.inv().apply(fluid.particles.position.T.astype(np.float64) - place)
    assert fluid.particle_count == count == 567
    assert np.abs(own).max() < 0.5


def test_a_drop_that_a_thin_plate_stops_gives_it_its_momentum(make_fluid) -> None:
    """Without weight, a free plate of 1 kg and one particle of water of 1 kg: together they keep momentum and angular momentum."""
    fluid = make_fluid(lower=(-2, -2, -2), upper=(2, 2, 2), gravity=(0.0, 0.0, 0.0))
    sampling = sample_surface(box((0.5 * SPACING, 0.8, 0.8)), SPACING)
    handle = fluid.add_boundary(particles_of("plate", sampling))
    fluid.add_particles([[-0.3, 0.13, 0.21]], phase="water", velocity=(5.0, 0.5, 0.0))
    mass = fluid.config.rest_volume * fluid.config.phases[0].rest_density
    inverse = np.diag([1.0, 1.0, 1.0, 20.0, 20.0, 20.0])
    pose, turn, twist = np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(6)
    for _ in range(40):
        fluid.set_boundary_motion(handle, pose, turn, twist[:3], twist[3:], inverse)
        fluid.advance(0.005)
        pose, turn, twist = fluid.boundary_motion(handle)
    velocity, place = (
        np.asarray(each[:, 0], np.float64) for each in (fluid.particles.velocity, fluid.particles.position)
    )
    assert twist[0] > 0.5 and place[0] < pose[0] + 0.1 * SPACING
    assert mass * velocity + twist[:3] == pytest.approx(mass * np.array([5.0, 0.5, 0.0]), abs=1e-5)
    turning = mass * np.cross(place, velocity) + twist[3:] / 20.0 + np.cross(pose, twist[:3])
    assert turning == pytest.approx(mass * np.cross([-0.3, 0.13, 0.21], [5.0, 0.5, 0.0]), abs=2e-2)
