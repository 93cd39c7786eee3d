"""Loads without particles against closed forms: Archimedes, stability, wave pressure, Morison's terms, and damping as a derivative."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from oilsim.loads.load_model import LoadModel, Part, Station, heave_added_mass, heave_wave_damping, sway_added_mass
from oilsim.loads.morison import FloatingBodies
from oilsim.loads.wetted_volume import wetted_volume
from oilsim.sea import RegularWaves
from tests.seas import steady_sea

RHO, G = 1000.0, 9.81
NONE = np.zeros(3)


def part_of(mesh: trimesh.Trimesh, added_mass=NONE, wave_damping=NONE, design_volume=None) -> Part:
    volume = 0.5 * mesh.volume if design_volume is None else design_volume
    triangles = np.array(mesh.triangles, dtype=np.float64)
    return Part(
        triangles=triangles, added_mass=np.array(added_mass), wave_damping=np.array(wave_damping), design_volume=volume
    )


def pose_at(position, turn: Rotation | None = None) -> np.ndarray:
    return np.concatenate([position, (turn or Rotation.identity()).as_quat()])[None]


@pytest.mark.parametrize("seed", range(5))
def test_wetted_volume_is_that_of_the_cut_mesh(seed):
    dice = np.random.default_rng(seed)
    mesh = trimesh.creation.icosphere(subdivisions=2).apply_scale((1.0, 0.6, 0.4))
    normal = dice.normal(size=3)
    normal /= np.linalg.norm(normal)
    point = dice.uniform(-0.2, 0.2, 3)
    cut = trimesh.intersections.slice_mesh_plane(mesh, -normal, point, cap=True)
    found = wetted_volume(np.array(mesh.triangles, dtype=np.float64), point, normal)
    lid = -(cut.face_normals * cut.area_faces[:, None])[
        np.abs(cut.triangles_center @ normal - point @ normal) > 1e-9
    ].sum(axis=0)
    assert found[0] == pytest.approx(cut.volume, rel=1e-9)
    assert found[4] == pytest.approx(lid @ normal, rel=1e-9)
    assert point + found[1:4] / found[0] == pytest.approx(cut.center_mass, abs=1e-9)


def test_upright_box_has_archimedes_lift_and_its_metacentric_height():
    """Box 2 x 1 x 1 m with its centre 0.1 m above the water: V = 0.8 m3, GM = B^2 / (12 T) + z_B - z_G with T = 0.4 m."""
    box = FloatingBodies([LoadModel(parts=(part_of(trimesh.creation.box((2, 1, 1))),))], steady_sea(density=RHO))
    lift = box.loads(0.0, pose_at((3.0, 4.0, 0.1)), np.zeros((1, 6)))
    assert lift.wetted_volume[0] == pytest.approx(0.8)
    assert lift.wrench[0] == pytest.approx([0, 0, RHO * G * 0.8, 0, 0, 0], abs=1e-6)
    heel, height = 1e-3, 1.0 / (12 * 0.4) - 0.2 - 0.1
    heeled = box.loads(0.0, pose_at((0, 0, 0.1), Rotation.from_rotvec((heel, 0, 0))), np.zeros((1, 6)))
    assert heeled.wrench[0, 3] == pytest.approx(-RHO * G * 0.8 * height * heel, rel=1e-5)


def test_wave_pressure_lifts_a_small_body_with_the_surface():
    """A body much shorter than the wave that moves with the surface feels the weight of what it displaces, and its surface's slope."""
    wave = steady_sea(density=RHO, waves=RegularWaves(height=0.4, period=5.0625, direction=0.0))
    body = FloatingBodies([LoadModel(parts=(part_of(trimesh.creation.box((0.2, 0.2, 0.2))),))], wave)
    for time in np.linspace(0.0, 5.0, 7):
        height = float(wave.elevation(np.zeros((1, 2)), time)[0])
        loads = body.loads(time, pose_at((0, 0, height)), np.zeros((1, 6)))
        acceleration = wave.acceleration(np.array([[0.0, 0.0, height]]), time)[0]
        expected = RHO * 0.004 * (acceleration + np.array((0, 0, G)))
        assert loads.wrench[0, :3] == pytest.approx(expected, rel=2e-3, abs=2e-3 * RHO * 0.004 * G)


def test_morison_terms_have_their_size_and_sign():
    """Inertia A a, wave damping B (u - v), drag rho / 2 C_d A |u| u in water, and in air above it."""
    part = part_of(trimesh.creation.box((1, 1, 1)), added_mass=(100.0, 200.0, 300.0), wave_damping=(0, 0, 50.0))
    wet = Station(place=np.array((0, 0, -0.25)), drag_area=np.array((0.1, 2.0, 0.5)), wind_area=NONE, half_height=0.1)
    dry = Station(place=np.array((0, 0, 0.25)), drag_area=NONE, wind_area=np.array((1.0, 3.0, 0.0)), half_height=0.1)
    water = steady_sea(density=RHO, current=(0.5, 0.0), wind=(0.0, 10.0))
    bodies = FloatingBodies([LoadModel(parts=(part,), stations=(wet, dry))], water)
    twist = np.array([[0.2, 0.3, 0.1, 0, 0, 0]])
    loads = bodies.loads(0.0, pose_at((0, 0, 0)), twist)
    assert loads.wrench[0, 0] == pytest.approx(500.0 * 0.1 * 0.3**2 - 0.5 * 1.225 * 1.0 * 0.2**2)
    assert loads.wrench[0, 1] == pytest.approx(-500.0 * 2.0 * 0.3**2 + 0.5 * 1.225 * 3.0 * 9.7**2)
    assert loads.wrench[0, 2] == pytest.approx(RHO * G * 0.5 - 500.0 * 0.5 * 0.1**2 - 50.0 * 0.1)
    assert np.diag(loads.added_mass[0])[:3] == pytest.approx([100, 200, 300])
    assert loads.wrench[0, 3] == pytest.approx(
        0.25 * 500.0 * 2.0 * 0.3**2 * -1.0 - 0.25 * 0.5 * 1.225 * 3.0 * 9.7**2, rel=1e-9
    )


def test_water_carried_round_a_circle_pulls_outwards():
    """Water A that a part at a distance r from the turning body's centre carries along pulls with A w^2 r, besides its buoyancy."""
    mesh = trimesh.creation.box((0.2, 0.2, 0.2)).apply_translation((2.0, 0.0, 0.0))
    part = part_of(mesh, added_mass=(30.0, 40.0, 50.0), design_volume=mesh.volume)
    bodies = FloatingBodies([LoadModel(parts=(part,))], steady_sea(density=RHO))
    turn = Rotation.from_rotvec((0.0, 0.0, 0.6))
    found = bodies.loads(0.0, pose_at((0, 0, -1.0), turn), np.array([[0, 0, 0, 0, 0, 1.5]]))
    lift = RHO * G * 0.2**3
    assert found.wrench[0, :3] == pytest.approx(turn.apply((30.0 * 1.5**2 * 2.0, 0.0, lift)), abs=1e-9)
    assert found.wrench[0, 3:] == pytest.approx(turn.apply((0.0, -2.0 * lift, 0.0)), abs=1e-9)


def test_damping_is_the_derivative_of_the_wrench_by_the_twist():
    dice = np.random.default_rng(3)
    part = part_of(trimesh.creation.box((1, 1, 1)), wave_damping=(20, 30, 50.0))
    stations = tuple(
        Station(
            place=dice.uniform(-0.5, 0.5, 3),
            drag_area=dice.uniform(0, 2, 3),
            wind_area=dice.uniform(0, 2, 3),
            half_height=0.2,
        )
        for _ in range(4)
    )
    bodies = FloatingBodies(
        [LoadModel(parts=(part,), stations=stations)], steady_sea(density=RHO, current=(1.0, -0.7), wind=(3, 4))
    )
    pose, twist = pose_at((0.1, 0.2, 0.05), Rotation.from_rotvec((0.2, -0.1, 0.7))), dice.uniform(-0.3, 0.3, (1, 6))
    found = bodies.loads(0.0, pose, twist)
    for axis in range(6):
        step = 1e-6 * np.eye(6)[axis]
        change = bodies.loads(0.0, pose, twist + step).wrench - bodies.loads(0.0, pose, twist - step).wrench
        assert -change[0] / 2e-6 == pytest.approx(found.damping[0][:, axis], rel=1e-4, abs=1e-2)


def test_parts_and_bodies_add_up():
    """A box cut into two halves carries what the whole carries, in each of three bodies."""
    halves = [trimesh.creation.box((1, 1, 1)).apply_translation((x, 0, 0)) for x in (-0.5, 0.5)]
    whole = LoadModel(parts=(part_of(trimesh.creation.box((2, 1, 1)), (0, 400, 600)),))
    cut = LoadModel(parts=tuple(part_of(half, (0, 200, 300)) for half in halves))
    turn = Rotation.from_rotvec((0.1, 0.05, 0.4))
    poses = np.concatenate([pose_at((x, 0, 0.1), turn) for x in (0.0, 5.0, 9.0)])
    one, other = (
        FloatingBodies([model] * 3, steady_sea(density=RHO)).loads(0.0, poses, np.zeros((3, 6)))
        for model in (whole, cut)
    )
    assert other.wrench == pytest.approx(one.wrench, rel=1e-9, abs=1e-6)
    assert other.added_mass[:, :3, :3] == pytest.approx(one.added_mass[:, :3, :3])
    assert np.ptp(other.wrench, axis=0) == pytest.approx(0.0, abs=1e-6)


def moving_body(axes: np.ndarray):
    """Loads of one body in waves, current and wind that is described along its own axes turned by `axes` (3, 3); its pose is the same."""
    mesh = trimesh.creation.box((1.2, 0.8, 0.6))
    mesh.vertices = mesh.vertices @ axes.T
    part = part_of(mesh, np.abs(axes) @ [50.0, 120.0, 300.0], np.abs(axes) @ [20.0, 30.0, 70.0])
    stations = tuple(
        Station(
            place=axes @ place, drag_area=np.abs(axes) @ [0.4, 0.9, 1.5], wind_area=np.abs(axes) @ [0.7, 1.1, 0.2],
            half_height=0.3,
        )
        for place in ([0.5, 0.2, -0.1], [-0.4, 0.3, 0.2])
    )  # fmt: skip
    wave = RegularWaves(height=0.5, period=3.0, direction=0.6)
    sea = steady_sea(density=RHO, current=(1.0, -0.7), wind=(6.0, 4.0), waves=wave)
    turn = Rotation.from_matrix(Rotation.from_rotvec((0.4, -0.3, 0.9)).as_matrix() @ axes.T)
    twist = np.array([[0.3, -0.2, -0.4, 0.5, -0.6, 0.7]])
    return FloatingBodies([LoadModel(parts=(part,), stations=stations)], sea).loads(
        0.7, pose_at((0, 0, 0.1), turn), twist
    )


@pytest.mark.parametrize("turns", [1, 2])
def test_the_names_of_a_bodys_axes_change_nothing(turns):
    """A body whose x, y, z are called y, z, x, and again, has the same loads in the world."""
    axes = np.linalg.matrix_power(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), turns)
    wanted, found = moving_body(np.eye(3)), moving_body(axes)
    assert 0.1 < wanted.wetted_volume[0] < 0.5  # of 0.576 m3
    for one, other in zip(found, wanted, strict=True):
        assert one == pytest.approx(other, rel=1e-9, abs=1e-9 * np.abs(other).max())


def test_section_coefficients_are_those_of_half_cylinder_and_plate():
    """Half-immersed cylinder of radius R: rho pi R^2 / 2 in both directions; at k R = 0.8 its wave damping is
    0.41 of rho pi R^2 / 2 omega.
    """
    radius, frequency = 0.5, math.sqrt(0.8 * G / 0.5)
    mass = RHO * math.pi * radius**2 / 2
    assert heave_added_mass(RHO, 2 * radius) == pytest.approx(mass)
    assert sway_added_mass(RHO, radius) == pytest.approx(mass)
    assert heave_wave_damping(RHO, 2 * radius, radius, frequency) / (mass * frequency) == pytest.approx(
        0.413, abs=0.002
    )


def test_a_part_without_volume_is_refused():
    with pytest.raises(ValueError, match=r"part 0 wets 0 m3 at the design waterline, allowed: above 0 m3"):
        LoadModel(parts=(part_of(trimesh.creation.box((1, 1, 1)), design_volume=0.0),))


@pytest.mark.parametrize("rise", [-0.1, -0.04, 0.0, 0.3])
def test_a_plate_carries_water_along_by_its_own_depth_and_not_by_the_floats_volume(rise):
    """A skirt of 0.8 m in water that stands higher by `rise`: A (h / d)^2 across it, at the middle of h, whatever of the float is wet."""
    float_ = trimesh.creation.box((1.0, 0.4, 0.4)).apply_translation((0, 0, 0.0))
    part = replace(part_of(float_, added_mass=(0.0, 1000.0, 0.0), design_volume=0.08), plate=(-0.8, 0.8))
    found = FloatingBodies([LoadModel(parts=(part,))], steady_sea(density=RHO)).loads(
        0.0, pose_at((0, 0, -rise)), np.zeros((1, 6))
    )
    assert found.wetted_volume[0] == pytest.approx(0.4 * min(0.4, 0.2 + rise))
    wet = min(0.8, 0.8 + rise)
    carried = 1000.0 * (wet / 0.8) ** 2
    assert found.added_mass[0][1, 1] == pytest.approx(carried)
    assert found.added_mass[0][1, 3] == pytest.approx(
        carried * (0.8 - 0.5 * wet)
    )  # y by a turn about x: -z of the middle
