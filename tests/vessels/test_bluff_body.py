"""Bodies that are no hulls: coefficients in closed form, and the same motion in whatever axes a body is drawn."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from coupling.solids import bodies
from oilsim.loads.load_model import LoadModel, heave_wave_damping
from oilsim.loads.morison import FloatingBodies
from oilsim.sea import RegularWaves, Sea, SeaDescription
from scenarios.bench.scenario_run import SeaScene
from tests.seas import steady_sea
from vessels.bluff_body import PRESSING, bluff_body_loads, moments

RHO, G = 1000.0, 9.81
UP = np.array((0.0, 0.0, 1.0))
TURNS = [Rotation.from_rotvec(turn) for turn in ((0, 0, math.pi / 2), (0, math.pi / 2, 0), (0.7, -1.1, 0.4))]


def half_afloat(mesh: trimesh.Trimesh) -> LoadModel:
    """Loads of a body of half of water's density."""
    return bluff_body_loads(mesh, 0.5 * RHO * mesh.volume, RHO, UP)


def added_mass(model: LoadModel) -> np.ndarray:
    """Sum over all parts (3,) [kg]."""
    return np.sum([part.added_mass for part in model.parts], axis=0)


def pushed(mesh: trimesh.Trimesh, current=(0.0, 0.0), wind=(0.0, 0.0), turn=None) -> np.ndarray:
    """Force (3,) [N] of a current or a wind on a body at rest, half of it in the water, less its lift."""
    sea = steady_sea(density=RHO, current=current, wind=wind)
    pose = np.array([[0, 0, 0, *(turn or Rotation.identity()).as_quat()]])
    force = FloatingBodies([half_afloat(mesh)], sea).loads(0.0, pose, np.zeros((1, 6))).wrench[0, :3]
    return force - np.array((0, 0, RHO * G * 0.5 * mesh.volume))


def lying(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    return mesh.apply_transform(trimesh.transformations.rotation_matrix(math.pi / 2, (0, 1, 0)))


def test_ball_and_long_cylinder_carry_the_water_of_theory():
    """Half-immersed: rho V / 2 for a ball in all directions, rho V across a long cylinder and next to nothing along it."""
    ball = bodies.sphere(0.5)
    assert added_mass(half_afloat(ball)) == pytest.approx(0.25 * RHO * ball.volume, rel=1e-3)
    log = lying(bodies.cylinder(0.5, 20.0))
    along, *across = added_mass(half_afloat(log)) / (0.5 * RHO * log.volume)
    assert along < 0.01
    assert across == pytest.approx([1.0, 1.0], abs=0.02)


def test_long_box_makes_the_waves_of_its_sections():
    """Haskind's relation for a box of 40 x 1 x 1 m against b_33 of a section, at its own frequency of heave."""
    box = bodies.box((40.0, 1.0, 1.0))
    model = half_afloat(box)
    found = sum(part.wave_damping[2] for part in model.parts)
    frequency = math.sqrt(RHO * G * 40.0 / (0.5 * RHO * box.volume + added_mass(model)[2]))
    assert found == pytest.approx(40.0 * heave_wave_damping(RHO, 1.0, 0.5, frequency), rel=0.05)


def test_plate_cylinder_and_ball_are_pressed_by_their_areas():
    """C_n on a box's face, 2/3 of it on a cylinder and 1/2 on a ball, each on the wetted half as seen from ahead."""
    upright = bodies.cylinder(0.5, 1.0)
    for mesh, area, share in (
        (bodies.box((0.5, 2.0, 1.0)), 1.0, 1.0),
        (upright, 0.5, 2.0 / 3.0),
        (bodies.sphere(0.5), 0.5 * math.pi * 0.25, 0.5),
    ):
        force = pushed(mesh, current=(1.0, 0.0))
        assert force[0] == pytest.approx(0.5 * RHO * PRESSING * share * area, rel=0.03)  # friction is 1 % of it
        blown = pushed(mesh, wind=(10.0, 0.0))
        assert blown[0] == pytest.approx(0.5 * 1.225 * 100.0 * PRESSING * share * area, rel=0.03)


@pytest.mark.parametrize("mesh", [bodies.cylinder(0.5, 1.0), bodies.sphere(0.5)])
def test_round_bodies_have_no_direction(mesh):
    forces = [
        Rotation.from_euler("z", -angle).apply(pushed(mesh, current=(math.cos(angle), math.sin(angle))))
        for angle in np.linspace(0.0, math.pi, 7)
    ]
    assert np.ptp(forces, axis=0).max() < 0.005 * forces[0][0]


def test_damping_by_the_skin_is_the_derivative_of_the_wrench():
    whole = half_afloat(bodies.capsule(0.3, 0.8))
    bare = [replace(part, added_mass=np.zeros(3), wave_damping=np.zeros(3)) for part in whole.parts]
    sea = steady_sea(density=RHO, current=(1.0, -0.7), wind=(3, 4))
    afloat = FloatingBodies([replace(whole, parts=tuple(bare))], sea)
    pose = np.array([[0.1, 0.2, 0.05, *Rotation.from_rotvec((0.2, -0.1, 0.7)).as_quat()]])
    twist = np.array([[0.1, -0.2, 0.3, 0.4, -0.1, 0.2]])
    found = afloat.loads(0.0, pose, twist).damping[0]
    for axis in range(6):
        step = 1e-5 * np.eye(6)[axis]
        more, less = (afloat.loads(0.0, pose, twist + way * step).wrench[0] for way in (1.0, -1.0))
        assert (less - more) / 2e-5 == pytest.approx(found[:, axis], rel=1e-4, abs=1e-3 * np.abs(found).max())


def test_cells_hold_all_of_a_body_that_is_not_convex():
    """A ring, whose cuts have holes: volume, surface and second moments of the cells add up to the ring's."""
    ring = trimesh.creation.annulus(0.6, 1.0, 0.5)
    model = half_afloat(ring)
    pieces = [moments(part.triangles) for part in model.parts]
    assert sum(piece.volume for piece in pieces) == pytest.approx(ring.volume)
    assert sum(trimesh.triangles.area(part.skin).sum() for part in model.parts) == pytest.approx(ring.area)
    second = sum(piece.volume * (piece.second + np.outer(piece.center, piece.center)) for piece in pieces)
    assert model.axes @ second @ model.axes.T == pytest.approx(
        ring.volume * moments(np.array(ring.triangles)).second, abs=1e-9
    )


def beam() -> trimesh.Trimesh:
    return bodies.box((4.0, 1.0, 0.6))


def wedge() -> trimesh.Trimesh:
    """A body without any symmetry, about its centre."""
    corners = np.array([(-1.5, -0.6, -0.4), (1.8, -0.5, -0.4), (0.2, 1.1, -0.5), (0.1, 0.0, 0.8), (-1.2, 0.5, 0.4)])
    mesh = trimesh.convex.convex_hull(corners)
    return mesh.apply_translation(-mesh.center_mass)


def drift(mesh: trimesh.Trimesh, drawn: Rotation, heading: float) -> np.ndarray:
    """Track (T, 7) of a body that lies at `heading`, drawn in axes turned by `drawn`, in current, wind and waves."""
    own = mesh.copy()
    own.vertices = drawn.apply(mesh.vertices)
    waves = RegularWaves(height=0.3, period=3.0, direction=0.5)
    with SeaScene(steady_sea(density=RHO, current=(0.8, 0.1), wind=(4.0, -6.0), waves=waves), 0.05) as scene:
        there = Rotation.from_euler("z", heading) * drawn.inv()
        scene.add_body("b", own, density=450.0, position=(0, 0, 0), orientation=tuple(there.as_quat()))
        track = []
        for _ in range(100):
            scene.run(0.05)
            pose = scene.world.pose("b")
            track.append([*pose[:3], *(Rotation.from_quat(pose[3:]) * drawn).as_rotvec()])
    return np.array(track)


@pytest.mark.parametrize("shape", [beam, wedge, lambda: bodies.cylinder(0.5, 0.8), lambda: bodies.box((1.0, 1.0, 0.7))])
def test_a_body_moves_the_same_in_whatever_axes_it_is_drawn(shape):
    """The track of 5 s in current, wind and waves is the same within 2 % of its length, and turns within 2 degrees."""
    wanted = drift(shape(), Rotation.identity(), 0.6)
    length = np.linalg.norm(wanted[-1, :2])
    assert length > 0.5
    for drawn in TURNS:
        found = drift(shape(), drawn, 0.6)
        assert np.abs(found[:, :3] - wanted[:, :3]).max() < 0.02 * length
        apart = Rotation.from_rotvec(found[:, 3:]) * Rotation.from_rotvec(wanted[:, 3:]).inv()
        assert apart.magnitude().max() < math.radians(2.0)


@pytest.mark.parametrize("shape", [lambda: bodies.cylinder(0.5, 0.8), lambda: bodies.sphere(0.5)])
def test_a_round_buoy_drifts_the_same_in_every_direction(shape):
    """Turned about its axis by 0 to 90 degrees it takes the same way."""
    ways = [drift(shape(), Rotation.identity(), heading)[-1, :2] for heading in (0.0, 0.5, math.pi / 2)]
    assert np.ptp(ways, axis=0).max() < 0.01 * np.linalg.norm(ways[0])


@pytest.mark.slow
@pytest.mark.parametrize(("edge", "height", "low", "high"), [(0.2, 0.1, 0.85, 1.25), (1.0, 0.5, 0.3, 1.0)])
def test_a_body_adrift_in_waves_goes_no_faster_and_faster(edge, height, low, high):
    """Stokes drift a^2 omega k of waves of 0.4 m and 4 s is 16 mm/s at the surface, 14 over half a metre; a body has no more."""
    waves = RegularWaves(height=0.4, period=4.0, direction=0.0)
    sea = Sea(SeaDescription(depth=50.0, density=RHO, waves=waves, build_up=4.0))
    with SeaScene(sea, 0.05) as scene:
        scene.add_body("b", bodies.box((edge, edge, height)), density=500.0, position=(0, 0, 0))
        places = []
        for _ in range(25):
            scene.run(4.0)
            places.append(scene.world.pose("b")[0])
    stokes = 0.2**2 * (2.0 * math.pi / 4.0) ** 3 / G
    for drift in np.diff(places)[10:] / 4.0:
        assert low * stokes < drift < high * stokes
